//! Finds the cubes of the cache at the rim of a dense medium; whenever the volume, the medium or a clip plane changes.

use super::cache_layout::CacheLayout;
use super::cache_memory::CacheMemory;
use super::parts::Parts;
use super::pass_compiler::PassCompiler;
use super::path_queue;
use super::resources::Resources;
use super::shared::RIM_DEPTH;
use crate::error::Result;
use crate::gpu::types::*;
use crate::gpu::{Binding, Frame, Pass};
use crate::shared;

shared! {
    pub struct RimPush {
        pub bricks: uint,
        /// Bricks in a row of threads.
        pub row: uint,
    }
}

/// Whether there may be any in a lattice: a dense medium meets a face of the box or a clip plane.
pub fn may_exist(parts: &Parts, layout: &CacheLayout) -> bool {
    let steps = layout.step.iter().zip(&parts.field.spacing);
    let sides: Vec<f32> = steps.map(|(step, voxel)| step * voxel).collect();
    let at_faces = match layout.meets_faces {
        true => sides.iter().copied().fold(0.0, f32::max),
        false => 0.0,
    };
    let at_clips = match parts.clips.is_empty() {
        true => 0.0,
        false => sides.iter().map(|side| side * side).sum::<f32>().sqrt(),
    };
    parts.medium.largest_extinction() * at_clips.max(at_faces) > RIM_DEPTH
}

pub struct RimCubes(Pass);

impl RimCubes {
    pub fn new(passes: &PassCompiler<'_>) -> Result<Self> {
        Ok(RimCubes(passes.compile::<RimPush>("rim_cubes")?))
    }

    /// Returns how many there are. No queue of paths may be under way.
    pub fn run(&self, frame: &mut Frame, r: &Resources, cache: &CacheMemory) -> Result<u32> {
        let bindings = [
            ("scene_block", Binding::Buffer(&r.scene)),
            ("transfer", Binding::Image(&r.transfer)),
            ("clips", Binding::Buffer(&r.clips)),
            ("ranges", Binding::Image(&r.ranges)),
            ("counters", Binding::Buffer(&r.counters)),
            cache.brick_binding(),
            cache.rims_binding(),
        ];
        let bindings = [&r.volume_bindings()[..], &bindings].concat();
        let ([bricks, row], _) = cache.for_each_brick();
        let push = RimPush { bricks, row };
        let threads = [row, bricks.div_ceil(row), 1];
        frame.run(|f| f.zero(&r.counters))?;
        frame.run_in_slices(&self.0, &bindings, &push, threads)?;
        frame.run(|f| f.copy(&r.counters, &r.staging))?;
        Ok(path_queue::counted(r).rim_cubes)
    }
}
