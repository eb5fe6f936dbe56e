//! Finds the cubes of the cache that a surface cuts; whenever the volume or an isovalue changes.

use super::cache_memory::CacheMemory;
use super::cube_bits::{CubePush, mark};
use super::pass_compiler::PassCompiler;
use super::resources::Resources;
use crate::error::Result;
use crate::gpu::{Binding, Frame, Pass};

pub struct CutCells(Pass);

impl CutCells {
    pub fn new(passes: &PassCompiler<'_>) -> Result<Self> {
        Ok(CutCells(passes.compile::<CubePush>("cut_cells")?))
    }

    /// No queue of paths may be under way.
    pub fn run(&self, frame: &mut Frame, r: &Resources, cache: &CacheMemory) -> Result<()> {
        let bindings = [("surfaces", Binding::Buffer(&r.surfaces))];
        mark(frame, r, cache, &self.0, cache.cuts.as_ref(), &bindings).map(drop)
    }
}
