//! Distance, normal and colour of the first surface behind each pixel's centre.

use std::sync::Arc;

use super::resources::{FirstSurface, Resources};
use super::shared::Features;
use crate::error::Result;
use crate::gpu::{Binding, Device, Frame, Pass, PassDesc, Shaders, Specialization};

pub struct IsoDepth(Pass);

impl IsoDepth {
    pub fn new(device: &Arc<Device>, shaders: &Shaders, features: &Features) -> Result<Self> {
        let desc = PassDesc {
            name: "iso_depth",
            specialization: &features.words(),
            macros: &features.formats(),
        };
        Ok(IsoDepth(Pass::new(device, shaders, &desc)?))
    }

    pub fn run(&self, frame: &mut Frame, r: &Resources, to: &FirstSurface) -> Result<()> {
        let bindings = [
            ("scene_block", Binding::Buffer(&r.scene)),
            ("volume", Binding::Image(&r.volume)),
            ("clips", Binding::Buffer(&r.clips)),
            r.camera_binding(),
            ("ranges", Binding::Image(&r.ranges)),
            ("surfaces", Binding::Buffer(&r.surfaces)),
            ("normal_depth", Binding::Image(&to.normal_depth)),
            ("albedo", Binding::Image(&to.albedo)),
        ];
        frame.run_in_slices(&self.0, &bindings, &(), to.albedo.desc.extent)
    }
}
