//! How each surface reflects light of which the cache knows two moments; once a material.

use super::memory::CacheMemory;
use crate::error::Result;
use crate::gpu::{Binding, Frame, Pass, Work};
use crate::render::pass_compiler::PassCompiler;
use crate::render::resources::{Resources, bytes_of};
use crate::render::shared::{REFLECTANCE_ANGLES, Reflectance};

pub struct SurfaceReflectance(Pass);

impl SurfaceReflectance {
    pub fn new(passes: &PassCompiler<'_>) -> Result<Self> {
        Ok(SurfaceReflectance(passes.compile::<()>("reflectance")?))
    }

    pub fn run(&self, frame: &mut Frame, r: &Resources, cache: &CacheMemory) -> Result<()> {
        let bindings = [
            &[
                ("scene_block", Binding::Buffer(&r.scene)),
                ("clips", Binding::Buffer(&r.clips)),
                cache.reflectance_binding(),
            ][..],
            &r.volume_bindings(),
            &r.surface_bindings(),
        ]
        .concat();
        let threads = [cache.features.surface_count * REFLECTANCE_ANGLES, 1, 1];
        let work = Work::fill(bytes_of::<Reflectance>(threads[0]));
        frame.run(|recording| {
            recording.dispatch(&self.0, &bindings, &(), threads)?;
            recording.state_work(work);
            Ok(())
        })
    }
}
