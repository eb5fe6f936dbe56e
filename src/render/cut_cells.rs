//! Finds the cubes of the cache that a surface cuts; whenever the volume or an isovalue changes.

use super::cache_memory::CacheMemory;
use super::pass_compiler::PassCompiler;
use super::resources::Resources;
use crate::error::Result;
use crate::gpu::types::*;
use crate::gpu::{Binding, Frame, Pass};
use crate::shared;

shared! {
    pub struct CutPush {
        pub bricks: uint,
        /// Bricks in a row of workgroups.
        pub row: uint,
    }
}

pub struct CutCells(Pass);

impl CutCells {
    pub fn new(passes: &PassCompiler<'_>) -> Result<Self> {
        Ok(CutCells(passes.compile::<CutPush>("cut_cells")?))
    }

    pub fn run(&self, frame: &mut Frame, r: &Resources, cache: &CacheMemory) -> Result<()> {
        let bindings = [
            ("scene_block", Binding::Buffer(&r.scene)),
            ("clips", Binding::Buffer(&r.clips)),
            ("ranges", Binding::Image(&r.ranges)),
            ("surfaces", Binding::Buffer(&r.surfaces)),
            cache.brick_binding(),
            cache.cuts_binding(),
        ];
        let bindings = [&r.volume_bindings()[..], &bindings].concat();
        let ([bricks, row], threads) = cache.for_each_brick();
        let push = CutPush { bricks, row };
        r.run_in_slices(frame, &self.0, &bindings, &push, threads)
    }
}
