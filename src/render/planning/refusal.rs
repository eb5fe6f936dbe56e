//! The sentences about what does not fit: what it needs, and what would fit.

use super::in_bricks::{InBricks, least};
use super::ladder::COARSEST;
use super::{Plan, Planner};
use crate::bytes::exactly;
use crate::error::{Error, MemoryError, Result, unless_refused};
use crate::render::gpu_scene::GpuScene;
use crate::scene::Variant;

impl InBricks<'_> {
    /// The error that says what a scene needs that fits neither with its volume whole nor in bricks. `None` where the
    /// device's limits allow neither.
    pub(super) fn refusal(&self) -> Result<Option<MemoryError>> {
        let planner = self.planner;
        let Some(without_cache) = self.smallest_of_both(&planner.uncached)? else {
            return Ok(None);
        };
        if let Some(coarsest) = self.rungs.last()
            && let Err(why) = &coarsest.layout
            && planner.scene.render.variant == Variant::Caching
        {
            return Ok(Some(MemoryError::CacheScale {
                scale: coarsest.scale.to_string(),
                has_coarser: coarsest.scale > COARSEST,
                why: Box::new(why.clone()),
            }));
        }
        let cached = least(self.caches(), |scene| self.smallest_of_both(scene))?;
        let smallest_cache = cached.map(|plan| {
            format!(
                "{} needs {}",
                plan.variant.description(),
                exactly(plan.bytes())
            )
        });
        let budget = planner.budget;
        Ok(Some(match (planner.scene.render.variant, smallest_cache) {
            (Variant::Caching, Some(smallest_cache)) if without_cache.bytes() <= budget => {
                planner.no_cache(&without_cache, smallest_cache)
            }
            (Variant::Caching, None)
                if without_cache.bytes() <= budget
                    && let Some(limit) = self.limit_of_caches() =>
            {
                limit
            }
            (_, smallest_cache) => too_small(&without_cache, budget, smallest_cache),
        }))
    }

    /// The device's limit that no cache stays within, however large the budget is.
    fn limit_of_caches(&self) -> Option<MemoryError> {
        let limit = |scene| match self.planner.plan(&scene) {
            Err(Error::Memory(limit)) => Some(limit),
            _ => None,
        };
        self.caches().find_map(limit)
    }

    /// The smaller of the plans with the volume whole and in as few bricks as will do.
    fn smallest_of_both(&self, scene: &GpuScene) -> Result<Option<Plan>> {
        let whole = unless_refused(self.planner.plan(scene))?;
        let in_bricks = unless_refused(self.smallest(scene))?;
        let plans = [whole, in_bricks];
        Ok(plans.into_iter().flatten().min_by_key(Plan::bytes))
    }
}

impl Planner<'_> {
    /// What a plan with the whole volume would need, in words; `why` is the error with which the search for such a plan
    /// failed.
    pub(super) fn need_of_whole(&self, why: &MemoryError) -> String {
        match why {
            MemoryError::Plan {
                smallest_cache: Some(smallest_cache),
                ..
            } if self.scene.render.variant == Variant::Caching => {
                format!("with the whole volume, {smallest_cache}")
            }
            MemoryError::Plan {
                variant, needed, ..
            } => format!("{variant} with the whole volume needs {}", exactly(*needed)),
            MemoryError::Cache { smallest_cache, .. } => {
                format!("with the whole volume, {smallest_cache}")
            }
            other => format!("the whole volume is impossible: {other}"),
        }
    }

    /// The error for a scene that asks for a cache where only the variant without one fits.
    pub(super) fn no_cache(&self, without: &Plan, smallest_cache: String) -> MemoryError {
        MemoryError::Cache {
            budget: self.budget,
            smallest_cache,
            has_smaller: !self.allows_the_smallest(),
            non_caching: without.bytes(),
        }
    }
}

/// The error that says what is in the way and what would fit.
pub(super) fn too_small(
    without_cache: &Plan,
    budget: u64,
    smallest_cache: Option<String>,
) -> MemoryError {
    let largest = without_cache.resources.iter().max_by_key(|r| r.bytes);
    let largest = largest.expect("a plan has a picture at least");
    MemoryError::Plan {
        budget,
        variant: without_cache.variant.word(),
        is_in_bricks: without_cache.bricks.is_some(),
        needed: without_cache.bytes(),
        largest: largest.name.into(),
        largest_bytes: largest.bytes,
        smallest_cache,
    }
}
