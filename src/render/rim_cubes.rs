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
    }
}

/// Whether there may be any in a lattice: a dense medium meets a face of the box or a clip plane.
pub fn may_exist(parts: &Parts, layout: &CacheLayout) -> bool {
    let steps = layout.step.iter().zip(&parts.field.spacing);
    let diagonal = steps
        .map(|(step, voxel)| (step * voxel).powi(2))
        .sum::<f32>()
        .sqrt();
    let ends = layout.meets_faces || !parts.clips.is_empty();
    ends && parts.medium.largest_extinction() * diagonal > RIM_DEPTH
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
        let bricks = cache.active_bricks();
        frame.run(|f| {
            f.zero(&r.counters)?;
            f.pass(&self.0, &bindings, &RimPush { bricks }, [bricks, 1, 1])?;
            f.copy(&r.counters, &r.staging)
        })?;
        Ok(path_queue::counted(r).rim_cubes)
    }
}
