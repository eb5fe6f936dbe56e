//! Folds units of samples into the running mean and its spread.

use crate::error::Result;
use crate::gpu::types::*;
use crate::gpu::{Binding, Pass, Recording, Work};
use crate::render::bricks::VolumeBricks;
use crate::render::pass_compiler::PassCompiler;
use crate::render::resources::Resources;
use crate::shared;

shared! {
    pub struct AccumulatePush {
        /// Samples in each unit, and samples of each pixel in all units before.
        pub samples: uint,
        pub samples_before: uint,
        /// The first pixel, in the order of work, whose units are folded, and the first behind them.
        pub first: uint,
        pub end: uint,
    }
}

pub struct Accumulate(Pass);

impl Accumulate {
    pub fn new(passes: &PassCompiler<'_>) -> Result<Self> {
        Ok(Accumulate(passes.compile::<AccumulatePush>("accumulate")?))
    }

    /// Folds the `units` units of the pixels that `push` names.
    pub fn record<'r>(
        &'r self,
        recording: &mut Recording<'_, 'r>,
        r: &'r Resources,
        units: u32,
        push: &AccumulatePush,
    ) -> Result<()> {
        let streaming = r.bricks.as_ref().map(VolumeBricks::streaming_binding);
        let bindings = [
            ("scene_block", Binding::Buffer(&r.scene)),
            ("unit_sum", Binding::Image(&r.unit_sum)),
            ("mean", Binding::Image(&r.mean)),
            ("squares", Binding::Image(&r.squares)),
        ];
        let bindings: Vec<_> = bindings.into_iter().chain(streaming).collect();
        let pixels = push.end - push.first;
        recording.dispatch(
            &self.0,
            &bindings,
            push,
            [r.size[0], pixels.div_ceil(r.size[0]), 1],
        )?;
        let pixels = u64::from(pixels);
        let reads = (2 + u64::from(units)) * pixels;
        recording.state_work(Work::texels(reads, 2 * pixels));
        Ok(())
    }
}
