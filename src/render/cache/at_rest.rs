//! How a picture at rest gets its samples from the cache.

use super::camera_march::CameraMarch;
use super::memory::CacheMemory;
use crate::error::Result;
use crate::gpu::Frame;
use crate::render::delta_tracking::DeltaTracking;
use crate::render::pass_compiler::PassCompiler;
use crate::render::picture::bundle::{Bundle, BundleProgress};
use crate::render::resources::Resources;

pub enum AtRest {
    /// By a march, where a path may read the cache at its first collision (`Features::is_marched`).
    March(Box<CameraMarch>),
    /// By paths that end in the cache.
    Tracking(DeltaTracking),
}

impl AtRest {
    pub fn new(passes: &PassCompiler<'_>) -> Result<AtRest> {
        Ok(if passes.features.is_marched() {
            AtRest::March(Box::new(CameraMarch::new(passes)?))
        } else {
            AtRest::Tracking(DeltaTracking::through_cache(passes)?)
        })
    }

    /// Whether a sample is nearly free of noise: it is marched, and light is left to paths near less than 2 % of the cache's
    /// nodes.
    pub fn is_smooth(&self) -> bool {
        match self {
            AtRest::March(march) => march.leaves_next_to_nothing(),
            AtRest::Tracking(_) => false,
        }
    }

    /// Goes on with a bundle of units, or begins one.
    pub fn advance(
        &mut self,
        frame: &mut Frame,
        r: &Resources,
        cache: &CacheMemory,
        bundle: Bundle,
    ) -> Result<BundleProgress> {
        match self {
            AtRest::March(march) => march.advance(frame, r, cache, bundle),
            AtRest::Tracking(tracking) => tracking.advance(frame, r, &cache.bindings(), bundle),
        }
    }

    /// Runs once, without paths, the pass that the first slice of a sample does not get to ([`CameraMarch::warm_up`]).
    pub fn warm_up(&self, frame: &mut Frame, r: &Resources, cache: &CacheMemory) -> Result<()> {
        match self {
            AtRest::March(march) => march.warm_up(frame, r, cache),
            AtRest::Tracking(_) => Ok(()),
        }
    }

    /// States the work of marches since this was last done.
    pub fn collect(&self, frame: &mut Frame, r: &Resources, cache: &CacheMemory) -> Result<()> {
        match self {
            AtRest::March(march) => march.collect(frame, r, cache),
            AtRest::Tracking(_) => Ok(()),
        }
    }
}
