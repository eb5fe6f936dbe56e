//! How near and how far is what rays from the camera can meet, patch by patch of the picture; once a view.

use std::sync::Arc;

use super::resources::Resources;
use super::shared::Features;
use crate::error::Result;
use crate::gpu::{Binding, Device, Frame, Pass, PassDesc, Shaders, Specialization};

pub struct Patches(Pass);

impl Patches {
    pub fn new(device: &Arc<Device>, shaders: &Shaders, features: &Features) -> Result<Self> {
        let desc = PassDesc {
            name: "patches",
            specialization: &features.words(),
            macros: &features.formats(),
        };
        Ok(Patches(Pass::new(device, shaders, &desc)?))
    }

    /// `cells`: how many have a majorant, along each axis.
    pub fn run(&self, frame: &mut Frame, r: &Resources, cells: [u32; 3]) -> Result<()> {
        let bindings = [
            ("scene_block", Binding::Buffer(&r.scene)),
            ("volume", r.volume_binding()),
            ("transfer", Binding::Image(&r.transfer)),
            ("clips", Binding::Buffer(&r.clips)),
            ("ranges", Binding::Image(&r.ranges)),
            ("majorants", Binding::Image(&r.majorants)),
            ("surfaces", Binding::Buffer(&r.surfaces)),
            ("patches", Binding::Image(&r.patches)),
        ];
        frame.run(|f| {
            f.clear(&[&r.patches])?;
            f.pass(&self.0, &bindings, &(), cells)
        })
    }
}
