//! The plan for a volume that does not fit: some of its bricks are on the device at a time.
//!
//! A picture does not depend on which bricks those are; the time that it takes does. So the cache is given up to make
//! room for bricks where less than a quarter of the bricks that matter would be there at once: each path of the cache
//! then waits for about as many bricks as it saves. That is a rule of thumb. Where a render is long enough for a trial
//! (`engine/trial.rs`), it compares the caches on the device.

use std::sync::Arc;

use super::bricks::needed_bricks;
use super::gpu_scene::GpuScene;
use super::layout::BrickLayout;
use super::plan::{Choice, Plan, rungs, too_many_nodes, wants_cache};
use crate::bytes::human;
use crate::error::{Error, Result};
use crate::gpu::{Device, DeviceSummary};
use crate::scene::volume::Volume;
use crate::scene::{Scene, Variant};

/// The share of the bricks that matter below which a cache is given up.
const ENOUGH: f64 = 0.25;

/// A cache is worth comparing with a finer one if it leaves room for so many times as many bricks.
const MORE: f64 = 1.25;

/// The best variant that stays within `budget` bytes with the volume in bricks. `None` if none fits.
pub fn choose(
    device: &Arc<Device>,
    limits: &DeviceSummary,
    budget: u64,
    volume: &Volume,
    scene: &Scene,
    next_better: &str,
) -> Result<Option<Choice>> {
    let uncached = GpuScene::new(scene, volume, 0);
    let needed = needed_bricks(&uncached, volume);
    let mut best = None;
    for plan in plans(device, limits, budget, volume, scene, uncached, needed) {
        let plan = plan?;
        let is_enough = share(&plan, needed) >= ENOUGH;
        best = Some(plan);
        if is_enough {
            break;
        }
    }
    Ok(best.map(|plan| choice(plan, needed, next_better)))
}

/// The caches that stay within `budget` bytes with the volume in bricks and leave it unlike numbers of them, the finest
/// first.
pub fn caches(
    device: &Arc<Device>,
    limits: &DeviceSummary,
    budget: u64,
    volume: &Volume,
    scene: &Scene,
    next_better: &str,
) -> Result<Vec<Choice>> {
    let uncached = GpuScene::new(scene, volume, 0);
    let needed = needed_bricks(&uncached, volume);
    let mut caches = Vec::new();
    let mut most = 0.0;
    for plan in plans(device, limits, budget, volume, scene, uncached, needed) {
        let plan = plan?;
        let share = share(&plan, needed).min(1.0);
        if plan.variant.cache().is_some() && share >= MORE * most {
            most = share;
            caches.push(choice(plan, needed, next_better));
        }
    }
    Ok(caches)
}

/// What fits with the volume in bricks: the finest cache first, no cache last.
fn plans(
    device: &Arc<Device>,
    limits: &DeviceSummary,
    budget: u64,
    volume: &Volume,
    scene: &Scene,
    uncached: GpuScene,
    needed: u32,
) -> impl Iterator<Item = Result<Plan>> {
    let has_none = scene.render.variant != Variant::Caching;
    let caches = wants_cache(scene).then(|| rungs(&uncached, volume, scene, limits));
    let without = has_none.then(|| uncached.clone());
    let layouts = caches
        .into_iter()
        .flatten()
        .filter_map(|rung| rung.layout.ok());
    let cached = layouts.map(move |layout| uncached.clone().with_cache(layout));
    cached.chain(without).filter_map(move |candidate| {
        let plan = fill(device, limits, budget, candidate, needed).transpose()?;
        match plan {
            Ok(plan) if too_many_nodes(&plan, limits, scene).is_some() => None,
            plan => Some(plan),
        }
    })
}

fn choice(plan: Plan, needed: u32, next_better: &str) -> Choice {
    Choice {
        reason: format!(
            "{} takes {} with the volume in bricks, {} of the {needed} that matter at a time: the whole volume does not fit",
            plan.variant.description(),
            human(plan.bytes()),
            capacity(&plan).min(needed),
        ),
        next_better: next_better.into(),
        plan,
    }
}

fn capacity(plan: &Plan) -> u32 {
    plan.bricks.map_or(0, |layout| layout.capacity())
}

fn share(plan: &Plan, needed: u32) -> f64 {
    f64::from(capacity(plan)) / f64::from(needed.max(1))
}

/// The most bricks that one sample of a pixel reads at once. A ray meets at most as many as the volume has along its axes
/// together. A path reads along one ray at a time. The march of a cached picture begins anew when a brick is missing, and
/// reads along several: the camera's ray, rays to suns from four points of the medium (`camera_march.comp`), and a ray to
/// each sun from every crossing with a surface. All rays to one sun lie in a plane, which meets at most as many bricks as
/// three faces of the volume have; together, no more than the `needed` ones that matter.
fn most_at_once(layout: &BrickLayout, scene: &GpuScene, needed: u64) -> u64 {
    let [x, y, z] = layout.bricks.map(u64::from);
    let (along_a_ray, in_a_plane) = (x + y + z, x * y + y * z + z * x);
    let features = scene.features();
    let suns = u64::from(features.sun_count);
    let surfaces = &scene.parts.surfaces.iso;
    let beside = match (features.cache_order, suns) {
        (0, _) | (_, 0) => 0,
        _ if surfaces.is_empty() => 4 * along_a_ray,
        // The first crossing is the last.
        _ if surfaces.iter().all(|surface| surface.opacity >= 1.0) => (4 + suns) * along_a_ray,
        _ => 4 * along_a_ray + suns * in_a_plane,
    };
    let of_one_ray = along_a_ray.min(layout.total().into());
    of_one_ray.max((along_a_ray + beside).min(needed))
}

/// A plan with as many bricks as the budget has room for, of `needed` that matter. `None` if they are too few for a sample.
fn fill(
    device: &Arc<Device>,
    limits: &DeviceSummary,
    budget: u64,
    scene: GpuScene,
    needed: u32,
) -> Result<Option<Plan>> {
    let planned = |places| planned(device, limits, &scene, places);
    let smallest = match planned(1) {
        Ok(plan) => plan,
        Err(Error::Memory(_)) => return Ok(None),
        Err(other) => return Err(other),
    };
    let Some(layout) = smallest.bricks else {
        return Ok(None);
    };
    let voxel_bytes = scene.parts.field.stored.bytes() as u64;
    let brick_bytes = voxel_bytes * u64::from(layout.pitch()).pow(3);
    let left = budget.saturating_sub(smallest.bytes());
    let most_image = limits.max_allocation_bytes / brick_bytes;
    let mut places = (1 + left / brick_bytes)
        .min(most_image)
        .min(layout.total().into());
    let least = most_at_once(&layout, &scene, needed.into());
    while places >= least {
        match planned(places) {
            Ok(plan) if plan.bytes() <= budget => return Ok(Some(plan)),
            Ok(_) | Err(Error::Memory(_)) if places == least => return Ok(None),
            Ok(_) | Err(Error::Memory(_)) => {
                places = (places - places.div_ceil(32)).max(least);
            }
            Err(other) => return Err(other),
        }
    }
    Ok(None)
}

/// The plan with as few bricks as a sample needs, of `needed` that matter, whatever the budget is.
pub fn smallest(
    device: &Arc<Device>,
    limits: &DeviceSummary,
    scene: &GpuScene,
    needed: u32,
) -> Result<Plan> {
    let layout = BrickLayout::new(scene.parts.field.dims, 1, limits);
    let least = most_at_once(&layout, scene, needed.into());
    planned(device, limits, scene, least)
}

/// The plan with room for so many bricks.
fn planned(
    device: &Arc<Device>,
    limits: &DeviceSummary,
    scene: &GpuScene,
    places: u64,
) -> Result<Plan> {
    let layout = BrickLayout::new(scene.parts.field.dims, places, limits);
    Plan::new(device, limits, &scene.clone().with_bricks(Some(layout)))
}
