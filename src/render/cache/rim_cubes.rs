//! Finds the cubes of the cache at the rim of a dense medium; whenever the volume, the medium, an obstacle or
//! a clip plane changes.

use super::cube_bits::{CubePush, mark};
use super::layout::CacheLayout;
use super::memory::CacheMemory;
use crate::error::Result;
use crate::gpu::{Binding, Frame, Pass};
use crate::render::parts::Parts;
use crate::render::pass_compiler::PassCompiler;
use crate::render::resources::Resources;
use crate::render::shared::{RIM_DEPTH, STEP_DEPTH};

/// Whether there may be any in a lattice: a dense medium meets a face of the box or a clip plane, or is so dense that it
/// may end between two voxels.
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
    let densest = parts.medium.largest_extinction();
    densest * at_clips.max(at_faces) > RIM_DEPTH
        || densest * parts.field.largest_spacing() > STEP_DEPTH
}

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
