//! The memory of the work of a batch (`work_list.rs`), which is done in portions: as many parts of nodes' paths are traced
//! at once as there is room for their sums.

use std::sync::Arc;

use crate::error::Result;
use crate::gpu::{Binding, Buffer, BufferDesc, DeviceSummary, Memory};
use crate::render::features::Features;
use crate::render::layout::CacheLayout;
use crate::render::resources::bytes_of;
use crate::render::shared::{COARSE_NODES, FLUX_FLOATS, LIGHT_FLOATS, NODES, SlotNode, Turn};

/// The most parts of a node's paths.
pub const MOST_PARTS: u32 = 64;

/// The most turns in a portion: Vulkan promises no more workgroups along an axis, and `merge_parts.comp` has one for each.
const MOST_TURNS: u32 = 65_535;

pub struct WorkMemory {
    slots: u32,
    /// The node that each slot is working on.
    pub slot_nodes: Buffer,
    /// The work that is under way.
    pub turns: Buffer,
    /// The sums of its parts.
    parts: Buffer,
    /// How many parts there is room for.
    pub most_items: u32,
}

impl WorkMemory {
    /// For paths in `slots` slots.
    pub fn allocate(
        memory: &Arc<Memory>,
        layout: &CacheLayout,
        features: &Features,
        slots: u32,
    ) -> Result<WorkMemory> {
        let most_items = most_items(slots, layout, features, &memory.limits);
        let on_device = |name, bytes| Buffer::new(memory, BufferDesc::device(name, bytes));
        let turns = BufferDesc::upload("cache: turns", turn_bytes(most_items));
        Ok(WorkMemory {
            slots,
            slot_nodes: on_device("cache: nodes of slots", bytes_of::<SlotNode>(slots))?,
            turns: Buffer::new(memory, turns)?,
            parts: on_device("cache: parts", part_bytes(features, most_items))?,
            most_items,
        })
    }

    /// Makes room for paths in `slots` slots.
    pub fn resize(
        &mut self,
        layout: &CacheLayout,
        features: &Features,
        slots: u32,
        limits: &DeviceSummary,
    ) -> Result<()> {
        self.slots = slots;
        self.most_items = most_items(slots, layout, features, limits);
        self.slot_nodes.resize(bytes_of::<SlotNode>(slots))?;
        self.turns.resize(turn_bytes(self.most_items))?;
        self.parts.resize(part_bytes(features, self.most_items))
    }

    pub fn slots(&self) -> u32 {
        self.slots
    }

    /// The resources by which nodes get their paths.
    pub fn bindings(&self) -> [(&'static str, Binding<'_>); 2] {
        [
            ("turns", Binding::Buffer(&self.turns)),
            ("parts", Binding::Buffer(&self.parts)),
        ]
    }
}

/// Bytes of the sums of so many items: those of light, and of the flux if the cache holds it (`turns.glsl`).
fn part_bytes(features: &Features, items: u32) -> u64 {
    let floats = LIGHT_FLOATS + FLUX_FLOATS * features.flux_columns;
    bytes_of::<f32>(floats) * u64::from(items)
}

fn turn_bytes(items: u32) -> u64 {
    bytes_of::<Turn>(most_turns(items))
}

/// The most items in a portion. A cache of few nodes has no use for many; all parts of a brick have room.
fn most_items(
    slots: u32,
    layout: &CacheLayout,
    features: &Features,
    limits: &DeviceSummary,
) -> u32 {
    const LEAST: u64 = (MOST_PARTS * NODES) as u64;
    let useful = u64::from(items_for(slots)).min(2 * layout.active_nodes());
    let largest = limits.max_allocation_bytes / part_bytes(features, 1);
    useful.min(largest).max(LEAST) as u32
}

/// As many items as keep so many slots busy for a while.
fn items_for(slots: u32) -> u32 {
    (16 * slots).clamp(1 << 14, MOST_TURNS * COARSE_NODES)
}

/// The most turns in a portion with so many items: a turn has at least one item for each node of the coarse lattice in a
/// brick.
fn most_turns(items: u32) -> u32 {
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
