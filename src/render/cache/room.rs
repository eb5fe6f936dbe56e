//! Room for the work of a batch (`work_list.rs`), which is done in portions: how many parts of nodes' paths are traced at
//! once, and what their sums take.

use crate::gpu::DeviceSummary;
use crate::render::features::Features;
use crate::render::layout::CacheLayout;
use crate::render::shared::{COARSE_NODES, FLUX_FLOATS, LIGHT_FLOATS, NODES};

/// The most parts of a node's paths.
pub const MOST_PARTS: u32 = 64;

/// The most turns in a portion: Vulkan promises no more workgroups along an axis, and `merge_parts.comp` has one for each.
const MOST_TURNS: u32 = 65_535;

/// Bytes of the sums of an item: those of light, and of the flux if the cache holds it (`turns.glsl`).
pub fn part_bytes(features: &Features) -> u64 {
    let floats = LIGHT_FLOATS + FLUX_FLOATS * features.flux_columns;
    u64::from(floats) * size_of::<f32>() as u64
}

/// The most items in a portion. A cache of few nodes has no use for many; all parts of a brick have room.
pub fn most_items(
    slots: u32,
    layout: &CacheLayout,
    features: &Features,
    limits: &DeviceSummary,
) -> u32 {
    const LEAST: u64 = (MOST_PARTS * NODES) as u64;
    let useful = u64::from(items_for(slots)).min(2 * layout.active_nodes());
    let largest = limits.max_allocation_bytes / part_bytes(features);
    useful.min(largest).max(LEAST) as u32
}

/// As many items as keep so many slots busy for a while.
fn items_for(slots: u32) -> u32 {
    (16 * slots).clamp(1 << 14, MOST_TURNS * COARSE_NODES)
}

/// The most turns in a portion with so many items: a turn has at least one item for each node of the coarse lattice in a
/// brick.
pub fn most_turns(items: u32) -> u32 {
    items / COARSE_NODES
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_device_has_a_workgroup_for_each_turn() {
        for slots in [1, 1 << 10, 1 << 17, 1 << 20] {
            assert!(most_turns(items_for(slots)) <= 65_535, "{slots} slots");
        }
    }
}
