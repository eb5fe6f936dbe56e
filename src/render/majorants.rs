//! The majorant of each macrocell; once a transfer function.

use std::sync::Arc;

use super::resources::Resources;
use super::shared::Features;
use crate::error::Result;
use crate::gpu::{Binding, Device, Frame, Pass, PassDesc, Shaders, Specialization};

pub struct Majorants(Pass);

impl Majorants {
    pub fn new(device: &Arc<Device>, shaders: &Shaders, features: &Features) -> Result<Self> {
        let desc = PassDesc {
            name: "majorants",
            specialization: &features.words(),
        };
        Ok(Majorants(Pass::new(device, shaders, &desc)?))
    }

    pub fn run(&self, frame: &mut Frame, r: &Resources) -> Result<()> {
        let bindings = [
            ("scene_block", Binding::Buffer(&r.scene)),
            ("transfer", Binding::Image(&r.transfer)),
            ("ranges", Binding::Image(&r.ranges)),
            ("majorants", Binding::Image(&r.majorants)),
        ];
        frame.run_in_slices(&self.0, &bindings, &(), r.majorants.desc.extent)
    }
}
