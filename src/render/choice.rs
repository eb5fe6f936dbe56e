//! The choice of what to render with.

use std::sync::Arc;

use super::plan::{self, Choice, choose_whole};
use super::plan_in_bricks;
use crate::error::{Error, MemoryError, Result};
use crate::gpu::{Device, DeviceSummary};
use crate::scene::volume::Volume;
use crate::scene::{self, Scene};

/// The best variant that stays within `budget` bytes and the device's limits: with the volume whole, or else in bricks.
pub fn choose(
    device: &Arc<Device>,
    limits: &DeviceSummary,
    budget: u64,
    volume: &Volume,
    scene: &Scene,
) -> Result<Choice> {
    match choose_whole(device, limits, budget, volume, scene) {
        Err(Error::Memory(why)) if scene.render.variant != scene::Variant::Published => {
            let better = whole(&why);
            let chosen = plan_in_bricks::choose(device, limits, budget, volume, scene, &better)?;
            chosen.ok_or(Error::Memory(why))
        }
        other => other,
    }
}

/// The caches that are worth comparing on the device where [`choose`] has chosen a plan: the one of that plan, or where
/// the volume is in bricks, several.
pub fn caches(
    device: &Arc<Device>,
    limits: &DeviceSummary,
    budget: u64,
    volume: &Volume,
    scene: &Scene,
    chosen: &Choice,
) -> Result<Vec<Choice>> {
    match (chosen.plan.bricks, chosen.plan.variant.cache()) {
        (Some(_), _) => {
            let better = &chosen.next_better;
            plan_in_bricks::caches(device, limits, budget, volume, scene, better)
        }
        (None, Some(_)) => Ok(vec![chosen.clone()]),
        (None, None) => Ok(Vec::new()),
    }
}

/// What a plan with the whole volume would need, of which the search for one says `why` there is none.
fn whole(why: &MemoryError) -> String {
    match why {
        MemoryError::Plan {
            variant, needed, ..
        } => format!(
            "{variant} with the whole volume needs {}",
            plan::needs(*needed)
        ),
        MemoryError::Cache { smallest_cache, .. } => {
            format!("with the whole volume, {smallest_cache}")
        }
        other => format!("the whole volume is impossible: {other}"),
    }
}
