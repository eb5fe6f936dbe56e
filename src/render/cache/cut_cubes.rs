//! Finds the cubes of the cache that a surface cuts, and on which side of the surfaces its nodes are; whenever the
//! volume, the medium, an obstacle or a clip plane changes.

use super::cube_bits::{CubePush, mark};
use super::memory::CacheMemory;
use crate::error::Result;
use crate::gpu::{Binding, Frame, Pass};
use crate::render::pass_compiler::PassCompiler;
use crate::render::resources::Resources;

pub struct CutCubes(Pass);

impl CutCubes {
    pub fn new(passes: &PassCompiler<'_>) -> Result<Self> {
        Ok(CutCubes(passes.compile::<CubePush>("cut_cubes")?))
    }

    /// No queue of paths may be under way.
    pub fn run(&self, frame: &mut Frame, r: &Resources, cache: &CacheMemory) -> Result<()> {
        let bindings = [("surfaces", Binding::Buffer(&r.surfaces))];
        mark(frame, r, cache, &self.0, cache.cuts.as_ref(), &bindings).map(drop)
    }
}
