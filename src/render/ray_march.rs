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
        /// Every `stride`-th pixel along both axes is marched.
        pub stride: uint,
        /// Transmittance below which a march ends.
        pub opaque_below: float,
        /// Factor on the length of steps.
        pub step_scale: float,
        /// 1: the result is not the picture, but the part of it that the picture at rest takes from the cache as
        /// well, and in alpha the whole picture's mean over channels.
        pub measures: uint,
        /// 1: bricks get their weights.
        pub weighs: uint,
    }
}

/// Transmittance below which nothing behind can be seen in eight bits.
const OPAQUE_BELOW: f32 = 1e-3;

/// Factor on the length of steps for a picture in motion.
const STEP_SCALE: f32 = 2.0;

pub struct RayMarch(Pass);

impl RayMarch {
    pub fn new(passes: &PassCompiler<'_>) -> Result<Self> {
        Ok(RayMarch(passes.compile::<MarchPush>("ray_march")?))
    }

    /// Marches a picture of few pixels into `unit_sum`, in a submission under way. Rays take longer steps.
    pub fn record(&self, frame: &mut Frame, r: &Resources, cache: &CacheMemory) -> Result<()> {
        let [width, height] = r.size;
        let push = MarchPush {
            step_scale: STEP_SCALE,
            ..push(1)
        };
        frame.pass(&self.0, &bindings(r, cache), &push, [width, height, 1])
    }

    /// Marches the next slice of the picture into `unit_sum`. Returns whether it was the last.
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

    /// Marches every `stride`-th pixel for `question` (`for_error`, `for_weights`); the answer is in the corner of
    /// `unit_sum`, or in the bricks.
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

/// The question from which the cache's error is measured (`MarchPush::measures`), in every `stride`-th pixel along
/// both axes.
pub fn for_error(stride: u32) -> MarchPush {
    MarchPush {
        measures: 1,
        ..push(stride)
    }
}

/// The question for the weights of bricks in every `stride`-th pixel along both axes; `unit_sum` is overwritten.
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
    }
}

fn bindings<'a>(r: &'a Resources, cache: &'a CacheMemory) -> Vec<(&'static str, Binding<'a>)> {
    [
        &r.medium_bindings()[..],
        &r.surface_bindings(),
        &cache.bindings(),
        &[
            cache.brick_binding(),
            cache.reflectance_binding(),
            r.camera_binding(),
            ("unit_sum", Binding::Image(&r.unit_sum)),
        ],
    ]
    .concat()
}
