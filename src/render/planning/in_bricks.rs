//! The plan for a volume that does not fit: some of its bricks are on the device at a time.
//!
//! A picture does not depend on which bricks those are; the time that it takes does. So the cache is given up to make
//! room for bricks where less than a quarter of the needed bricks would be there at once: each path of the cache
//! then waits for about as many bricks as it saves. That is a rule of thumb. Where a render is long enough for a trial
//! (`engine/trial.rs`), it compares the caches on the device.

use super::ladder::Rung;
use super::{Choice, Plan, Planner};
use crate::bytes::exactly;
use crate::error::{Error, Result, unless_refused};
use crate::render::bricks::needed_bricks;
use crate::render::gpu_scene::GpuScene;
use crate::render::layout::BrickLayout;
use crate::scene::Variant;

/// The share of the needed bricks below which a cache is given up.
const ENOUGH: f64 = 0.25;

/// A cache is worth comparing with a finer one if it leaves room for so many times as many bricks.
const MORE: f64 = 1.25;

/// A planner, and what all of its plans with the volume in bricks have in common.
pub struct InBricks<'a> {
    pub(super) planner: &'a Planner<'a>,
    /// Number of needed bricks.
    needed: u32,
    /// The caches that the scene allows, kept since finding their bricks takes time; none where no cache is looked for.
    pub(super) rungs: Vec<Rung>,
}

impl<'a> InBricks<'a> {
    pub fn new(planner: &'a Planner<'a>) -> InBricks<'a> {
        InBricks {
            needed: needed_bricks(&planner.uncached, planner.volume),
            rungs: match planner.why_no_cache() {
                None => planner.rungs().collect(),
                Some(_) => Vec::new(),
            },
            planner,
        }
    }

    /// The best variant that fits. `None` if none does. `need_of_whole` is what a plan with the whole volume needs, in words.
    pub fn choose(&self, need_of_whole: &str) -> Result<Option<Choice>> {
        let candidates: Vec<GpuScene> = self.candidates().collect();
        let mut best = None;
        for (n, candidate) in candidates.iter().enumerate() {
            let Some(plan) = self.fill(candidate)? else {
                continue;
            };
            let is_enough = self.share(&plan) >= ENOUGH;
            best = Some((n, plan));
            if is_enough {
                break;
            }
        }
        let Some((n, plan)) = best else {
            return Ok(None);
        };
        let next_better = match self.least_need(candidates[..n].to_vec())? {
            Some(need) => format!("{need}; {need_of_whole}"),
            None => need_of_whole.into(),
        };
        Ok(Some(self.choice(plan, &next_better)))
    }

    /// What is needed at least for one of these to be chosen, in words. `None` if there is none, or if a variant with the
    /// whole volume needs no more: that would be chosen.
    fn least_need(&self, candidates: Vec<GpuScene>) -> Result<Option<String>> {
        let enough = |scene: &GpuScene| unless_refused(self.planned(scene, self.enough_for(scene)));
        let Some(plan) = least(candidates, enough)? else {
            return Ok(None);
        };
        let whole = least(self.candidates(), |scene| {
            unless_refused(self.planner.plan(scene))
        })?;
        let is_less = whole.is_none_or(|whole| plan.bytes() < whole.bytes());
        Ok(is_less.then(|| {
            let name = plan.variant.description();
            format!(
                "{name} with the volume in bricks needs {}",
                exactly(plan.bytes())
            )
        }))
    }

    /// The caches that fit, the finest first, without those that make room for less than 1.25 times (`MORE`) as many of the
    /// needed bricks as the one before.
    pub fn compared(&self, next_better: &str) -> Result<Vec<Choice>> {
        let mut caches = Vec::new();
        let mut most = 0.0;
        for candidate in self.candidates() {
            let Some(plan) = self.fill(&candidate)? else {
                continue;
            };
            let share = self.share(&plan).min(1.0);
            if plan.variant.cache().is_some() && share >= MORE * most {
                most = share;
                caches.push(self.choice(plan, next_better));
            }
        }
        Ok(caches)
    }

    /// The variants that may be chosen: the finest cache first, no cache last.
    fn candidates(&self) -> impl Iterator<Item = GpuScene> {
        let allows_no_cache = self.planner.scene.render.variant != Variant::Caching;
        let without = allows_no_cache.then(|| self.planner.uncached.clone());
        self.caches().chain(without)
    }

    /// The caches that may be chosen, the finest first.
    pub(super) fn caches(&self) -> impl Iterator<Item = GpuScene> {
        let planner = self.planner;
        let layouts = self.rungs.iter().flat_map(|rung| &rung.layout);
        layouts
            .filter(|layout| planner.too_many_nodes(layout).is_none())
            .map(|layout| planner.uncached.clone().with_cache(layout.clone()))
    }

    fn choice(&self, plan: Plan, next_better: &str) -> Choice {
        let (resident, needed) = (capacity(&plan).min(self.needed), self.needed);
        let how_many = if resident == needed {
            format!("all {needed} needed ones at once")
        } else if self.is_full(&plan) {
            format!(
                "{resident} of the {needed} needed ones at a time, as the device's images hold no more"
            )
        } else {
            format!("{resident} of the {needed} needed ones at a time")
        };
        Choice {
            reason: format!(
                "{} fits with the volume in bricks, {how_many}: the whole volume does not",
                plan.variant.description(),
            ),
            next_better: next_better.into(),
            plan,
        }
    }

    /// Whether the budget would have room for more bricks than the device's images have.
    fn is_full(&self, plan: &Plan) -> bool {
        let voxel_bytes = self.planner.uncached.parts.field.stored.bytes();
        let most = |layout: &BrickLayout| layout.most_places(voxel_bytes, self.planner.limits);
        let is_full = |layout: BrickLayout| u64::from(layout.capacity()) * 33 / 32 >= most(&layout);
        // A search for what fits leaves up to a 32nd of the budget.
        plan.bricks.is_some_and(is_full) && self.planner.budget / 32 * 31 > plan.bytes()
    }

    /// The share of the needed bricks for which there is room.
    fn share(&self, plan: &Plan) -> f64 {
        f64::from(capacity(plan)) / f64::from(self.needed.max(1))
    }

    /// A plan with as many bricks as the budget has room for. `None` if they are too few for a sample.
    fn fill(&self, scene: &GpuScene) -> Result<Option<Plan>> {
        let planned = |places| self.planned(scene, places);
        let Some(smallest) = unless_refused(planned(1))? else {
            return Ok(None);
        };
        let Some(layout) = smallest.bricks else {
            return Ok(None);
        };
        let voxel_bytes = scene.parts.field.stored.bytes();
        let brick_bytes = layout.brick_bytes(voxel_bytes);
        let left = self.planner.budget.saturating_sub(smallest.bytes());
        let mut places = (1 + left / brick_bytes)
            .min(layout.most_places(voxel_bytes, self.planner.limits))
            .min(layout.total().into());
        let least = most_at_once(&layout, scene, self.needed.into());
        let enough = self.enough_for(scene);
        while places >= least {
            match planned(places) {
                Ok(plan) if plan.bytes() <= self.planner.budget => return Ok(Some(plan)),
                Ok(_) | Err(Error::Memory(_)) if places == least => return Ok(None),
                Ok(_) | Err(Error::Memory(_)) => {
                    // The search must test `enough` itself, since that number decides whether the cache is given up.
                    let floor = if places > enough { enough } else { least };
                    places = (places - places.div_ceil(32)).max(floor);
                }
                Err(other) => return Err(other),
            }
        }
        Ok(None)
    }

    /// The fewest bricks with which a cache is not given up.
    fn enough_for(&self, scene: &GpuScene) -> u64 {
        let layout = self.layout(scene, 1);
        let share = (f64::from(self.needed) * ENOUGH).ceil() as u64;
        share.max(most_at_once(&layout, scene, self.needed.into()))
    }

    /// The plan with as few bricks as a sample needs, whatever the budget is.
    pub fn smallest(&self, scene: &GpuScene) -> Result<Plan> {
        let layout = self.layout(scene, 1);
        self.planned(scene, most_at_once(&layout, scene, self.needed.into()))
    }

    /// The plan with room for so many bricks.
    fn planned(&self, scene: &GpuScene, places: u64) -> Result<Plan> {
        let layout = self.layout(scene, places);
        self.planner.plan(&scene.clone().with_bricks(Some(layout)))
    }

    fn layout(&self, scene: &GpuScene, places: u64) -> BrickLayout {
        let field = &scene.parts.field;
        let voxel_bytes = field.stored.bytes();
        BrickLayout::new(field.dims, voxel_bytes, places, self.planner.limits)
    }
}

/// The plan of the fewest bytes of these scenes'. A coarser cache may need more than a finer one: its wide cubes count as rims
/// of the medium where narrow ones do not, and what is left to paths there takes memory for each pixel.
pub(super) fn least(
    scenes: impl IntoIterator<Item = GpuScene>,
    plan: impl Fn(&GpuScene) -> Result<Option<Plan>>,
) -> Result<Option<Plan>> {
    let plans = scenes
        .into_iter()
        .filter_map(|scene| plan(&scene).transpose());
    let plans = plans.collect::<Result<Vec<Plan>>>()?;
    Ok(plans.into_iter().min_by_key(Plan::bytes))
}

fn capacity(plan: &Plan) -> u32 {
    plan.bricks.map_or(0, |layout| layout.capacity())
}

/// The most bricks that one sample of a pixel reads at once. A ray meets at most as many as the volume has along its axes
/// together. A path reads along one ray at a time. The march of a cached picture begins anew when a brick is missing, and
/// reads along several: the camera's ray, rays to suns from four points of the medium (`camera_march.comp`), and a ray to
/// each sun from every crossing with a surface. All rays to one sun lie in a plane, which meets at most as many bricks as
/// three faces of the volume have. A path from a node in a film first reads around the node (`node_start.glsl`), where eight
/// bricks meet at most. Together, these are no more than the `needed` ones.
fn most_at_once(layout: &BrickLayout, scene: &GpuScene, needed: u64) -> u64 {
    let [x, y, z] = layout.bricks.map(u64::from);
    let (along_a_ray, in_a_plane) = (x + y + z, x * y + y * z + z * x);
    let features = scene.features();
    let suns = u64::from(features.sun_count);
    let surfaces = &scene.parts.surfaces.iso;
    let beside = match (features.first_cached_collision, suns) {
        (0, _) | (_, 0) => 0,
        _ if surfaces.is_empty() => 4 * along_a_ray,
        // The surfaces are opaque, so a ray has at most one crossing.
        _ if surfaces.iter().all(|surface| surface.opacity >= 1.0) => (4 + suns) * along_a_ray,
        _ => 4 * along_a_ray + suns * in_a_plane,
    };
    let around_a_node = if features.has_tents { 8 } else { 0 };
    let of_one_ray = along_a_ray.min(layout.total().into());
    of_one_ray.max((along_a_ray + beside.max(around_a_node)).min(needed))
}
