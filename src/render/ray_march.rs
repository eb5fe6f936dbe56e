//! The picture that the cache shows at once.

use super::cache_memory::CacheMemory;
use super::pass_compiler::PassCompiler;
use super::resources::Resources;
use crate::error::Result;
use crate::gpu::types::*;
use crate::gpu::{Binding, Frame, Pass, Slices};
use crate::shared;

shared! {
    pub struct MarchPush {
        /// Every so many pixels along both axes are marched.
        pub stride: uint,
        /// A transmittance behind which nothing is looked at.
        pub opaque_below: float,
        /// How many times as long as usual steps may be.
        pub step_scale: float,
        /// 1: instead of the picture, the part of it that a picture at rest takes from the cache as
        /// well, and in alpha the picture's mean over channels.
        pub measures: uint,
        /// 1: bricks are weighed.
        pub weighs: uint,
        /// 1: a pixel that misses bricks of the volume shows what is there.
        pub keeps_void: uint,
    }
}

/// Transmittance below which nothing behind can be seen in eight bits.
const OPAQUE_BELOW: f32 = 1e-3;

/// How many times as long as usual the steps of a picture in motion are.
const STEP_SCALE: f32 = 2.0;

pub struct RayMarch(Pass);

impl RayMarch {
    pub fn new(passes: &PassCompiler<'_>) -> Result<Self> {
        Ok(RayMarch(passes.compile::<MarchPush>("ray_march")?))
    }

    /// Leaves a picture of few pixels in `unit_sum`, in a submission under way. Their rays take longer
    /// steps.
    pub fn record(&self, frame: &mut Frame, r: &Resources, cache: &CacheMemory) -> Result<()> {
        let [width, height] = r.size;
        let push = MarchPush {
            step_scale: STEP_SCALE,
            keeps_void: 1,
            ..push(1)
        };
        frame.pass(&self.0, &bindings(r, cache), &push, [width, height, 1])
    }

    /// Leaves the next slice of the picture in `unit_sum`. Returns whether it was the last.
    pub fn advance(
        &self,
        frame: &mut Frame,
        r: &Resources,
        cache: &CacheMemory,
        slices: &mut Slices,
    ) -> Result<bool> {
        let push = push(1);
        let [width, height] = r.size;
        let threads = [width, height, 1];
        r.run_slice(frame, &self.0, &bindings(r, cache), &push, threads, slices)
    }

    /// Looks at few pixels for what `question` asks (`for_error`, `for_weights`); its answer is in the
    /// corner of `unit_sum`, or in the bricks.
    pub fn ask(
        &self,
        frame: &mut Frame,
        r: &Resources,
        cache: &CacheMemory,
        question: MarchPush,
    ) -> Result<()> {
        let [width, height] = r.size.map(|n| n.div_ceil(question.stride));
        let threads = [width, height, 1];
        r.run_in_slices(frame, &self.0, &bindings(r, cache), &question, threads)
    }
}

/// What the cache's error is measured by (`MarchPush::measures`), in every `stride`-th pixel along both axes.
pub fn for_error(stride: u32) -> MarchPush {
    MarchPush {
        measures: 1,
        ..push(stride)
    }
}

/// What the bricks weigh in every `stride`-th pixel along both axes; `unit_sum` is overwritten.
pub fn for_weights(stride: u32) -> MarchPush {
    MarchPush {
        weighs: 1,
        ..push(stride)
    }
}

fn push(stride: u32) -> MarchPush {
    MarchPush {
        stride,
        opaque_below: OPAQUE_BELOW,
        step_scale: 1.0,
        measures: 0,
        weighs: 0,
        keeps_void: 0,
    }
}

fn bindings<'a>(r: &'a Resources, cache: &'a CacheMemory) -> Vec<(&'static str, Binding<'a>)> {
    [
        &r.medium_bindings()[..],
        &r.surface_bindings(),
        &cache.bindings(),
        &[
            cache.brick_binding(),
            r.camera_binding(),
            ("unit_sum", Binding::Image(&r.unit_sum)),
        ],
    ]
    .concat()
}
