//! Distance, normal and colour of the first surface behind each pixel's centre: layers of the EXR.

use std::sync::Arc;

use crate::error::Result;
use crate::gpu::{Binding, Dispatch, Frame, Image, Memory, Pass, Work};
use crate::render::gpu_scene::GpuScene;
use crate::render::pass_compiler::PassCompiler;
use crate::render::resources::{Resources, picture_desc};

pub struct IsoDepth {
    pass: Pass,
    pub memory: FirstSurface,
}

/// The images that the pass writes.
pub struct FirstSurface {
    /// Normal and, in w, distance; +∞ where there is no surface.
    pub normal_depth: Image,
    pub albedo: Image,
}

impl FirstSurface {
    /// `None` where the scene has no surface.
    pub fn allocate(memory: &Arc<Memory>, scene: &GpuScene) -> Result<Option<FirstSurface>> {
        if scene.parts.surfaces.iso.is_empty() {
            return Ok(None);
        }
        let picture = |name| Image::new(memory, picture_desc(name, scene.parts.view.size));
        Ok(Some(FirstSurface {
            normal_depth: picture("normal and depth")?,
            albedo: picture("albedo")?,
        }))
    }
}

impl IsoDepth {
    pub fn new(passes: &PassCompiler<'_>, memory: FirstSurface) -> Result<Self> {
        let pass = passes.compile::<()>("iso_depth")?;
        Ok(IsoDepth { pass, memory })
    }

    pub fn run(&self, frame: &mut Frame, r: &Resources) -> Result<()> {
        let FirstSurface {
            normal_depth,
            albedo,
        } = &self.memory;
        let bindings = [
            ("scene_block", Binding::Buffer(&r.scene)),
            ("clips", Binding::Buffer(&r.clips)),
            r.camera_binding(),
            ("ranges", Binding::Image(&r.ranges)),
            ("surfaces", Binding::Buffer(&r.surfaces)),
            ("normal_depth", Binding::Image(normal_depth)),
            ("albedo", Binding::Image(albedo)),
        ];
        let [width, height] = r.size;
        let dispatch = Dispatch {
            pass: &self.pass,
            bindings: [&r.volume_bindings()[..], &bindings].concat(),
            push: (),
            threads: [width, height, 1],
        };
        r.run_in_slices(frame, &dispatch)?;
        let work = Work::texels(0, 2 * u64::from(r.pixels()));
        frame.timings.state_work(self.pass.name, work);
        Ok(())
    }

    pub fn resize(&mut self, [width, height]: [u32; 2]) -> Result<()> {
        let FirstSurface {
            normal_depth,
            albedo,
        } = &mut self.memory;
        normal_depth.resize([width, height, 1])?;
        albedo.resize([width, height, 1])
    }
}
