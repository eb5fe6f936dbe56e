//! Interpolated light for the cache's nodes that lie between those of the coarse lattice.

use super::memory::CacheMemory;
use crate::error::Result;
use crate::gpu::types::*;
use crate::gpu::{Binding, Frame, Pass, Work};
use crate::render::pass_compiler::PassCompiler;
use crate::render::resources::Resources;
use crate::shared;

shared! {
    pub struct SpreadPush {
        pub bricks: uint,
        /// Bricks in a row of workgroups.
        pub row: uint,
        /// Axis along which light is interpolated.
        pub axis: uint,
    }
}

pub struct SpreadLight(Pass);

impl SpreadLight {
    pub fn new(passes: &PassCompiler<'_>) -> Result<Self> {
        Ok(SpreadLight(passes.compile::<SpreadPush>("spread_light")?))
    }

    pub fn run(&self, frame: &mut Frame, r: &Resources, cache: &CacheMemory) -> Result<()> {
        let bindings = [
            &[("scene_block", Binding::Buffer(&r.scene))][..],
            &cache.bindings(),
            &cache.output_bindings(),
            &[cache.brick_binding()],
        ]
        .concat();
        let ([bricks, row], [x, y, _]) = cache.for_each_brick();
        frame.run(|recording| {
            (0..3).try_for_each(|axis| {
                let push = SpreadPush { bricks, row, axis };
                recording.dispatch(&self.0, &bindings, &push, [x, y, 1])?;
                recording.state_work(Work::texels(u64::from(bricks), 0));
                Ok(())
            })
        })
    }
}
