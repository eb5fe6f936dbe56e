//! Finds the cubes of the cache at the rim of a dense medium; whenever the volume, the medium, an obstacle or
//! a clip plane changes.

use super::cube_bits::{CubePush, mark};
use super::memory::CacheMemory;
use crate::error::Result;
use crate::gpu::{Binding, Frame, Pass};
use crate::render::pass_compiler::PassCompiler;
use crate::render::resources::Resources;

pub struct RimCubes(Pass);

impl RimCubes {
    pub fn new(passes: &PassCompiler<'_>) -> Result<Self> {
        Ok(RimCubes(passes.compile::<CubePush>("rim_cubes")?))
    }

    /// Returns how many there are. No queue of paths may be under way.
    pub fn run(&self, frame: &mut Frame, r: &Resources, cache: &CacheMemory) -> Result<u32> {
        let bindings = [("transfer", Binding::Image(&r.transfer))];
        mark(frame, r, cache, &self.0, cache.rims.as_ref(), &bindings)
    }
}
