//! The choice of what to render with.

use std::sync::Arc;

use super::bricks::needed_bricks;
use super::gpu_scene::GpuScene;
use super::plan::{Choice, Plan, choose_whole, needs, no_cache, rungs, too_small, wants_cache};
use super::plan_in_bricks;
use crate::error::{Error, MemoryError, Result, unless_refused};
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
            let better = whole(&why, scene.render.variant);
            let chosen = plan_in_bricks::choose(device, limits, budget, volume, scene, &better)?;
            match chosen {
                Some(choice) => Ok(choice),
                None => Err(refusal(device, limits, budget, volume, scene)?
                    .unwrap_or(why)
                    .into()),
            }
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

/// The error that says what a scene needs that fits neither with its volume whole nor in bricks. `None` where the device's limits
/// allow neither.
fn refusal(
    device: &Arc<Device>,
    limits: &DeviceSummary,
    budget: u64,
    volume: &Volume,
    scene: &Scene,
) -> Result<Option<MemoryError>> {
    let uncached = GpuScene::new(scene, volume, 0);
    let needed = needed_bricks(&uncached, volume);
    let smallest = |scene: &GpuScene| -> Result<Option<Plan>> {
        let whole = unless_refused(Plan::new(device, limits, scene))?;
        let in_bricks = plan_in_bricks::smallest(device, limits, scene, needed);
        let plans = [whole, unless_refused(in_bricks)?];
        Ok(plans.into_iter().flatten().min_by_key(Plan::bytes))
    };
    let Some(without_cache) = smallest(&uncached)? else {
        return Ok(None);
    };
    let rungs = wants_cache(scene).then(|| rungs(&uncached, volume, scene, limits));
    let coarsest = rungs.into_iter().flatten().last();
    let cached = match coarsest.and_then(|rung| rung.layout.ok()) {
        Some(layout) => smallest(&uncached.clone().with_cache(layout))?,
        None => None,
    };
    let smallest_cache = cached.map(|plan| {
        format!(
            "{} needs {}",
            plan.variant.description(),
            needs(plan.bytes())
        )
    });
    Ok(Some(match (scene.render.variant, smallest_cache) {
        (scene::Variant::Caching, Some(smallest_cache)) if without_cache.bytes() <= budget => {
            no_cache(&without_cache, budget, smallest_cache)
        }
        (_, smallest_cache) => too_small(&without_cache, budget, smallest_cache),
    }))
}

/// What a plan with the whole volume would need, of which the search for one says `why` there is none.
fn whole(why: &MemoryError, wanted: scene::Variant) -> String {
    match why {
        MemoryError::Plan {
            smallest_cache: Some(smallest_cache),
            ..
        } if wanted == scene::Variant::Caching => {
            format!("with the whole volume, {smallest_cache}")
        }
        MemoryError::Plan {
            variant, needed, ..
        } => format!("{variant} with the whole volume needs {}", needs(*needed)),
        MemoryError::Cache { smallest_cache, .. } => {
            format!("with the whole volume, {smallest_cache}")
        }
        other => format!("the whole volume is impossible: {other}"),
    }
}
