//! The range of values in each macrocell; once a volume.

use std::sync::Arc;

use super::resources::Resources;
use super::shared::Features;
use crate::error::Result;
use crate::gpu::{Binding, Device, Frame, Pass, PassDesc, Shaders, Specialization};

pub struct MacrocellRanges(Pass);

impl MacrocellRanges {
    pub fn new(device: &Arc<Device>, shaders: &Shaders, features: &Features) -> Result<Self> {
        let desc = PassDesc {
            name: "macrocell_ranges",
            specialization: &features.words(),
        };
        Ok(MacrocellRanges(Pass::new(device, shaders, &desc)?))
    }

    pub fn run(&self, frame: &mut Frame, r: &Resources) -> Result<()> {
        let bindings = [
            ("scene_block", Binding::Buffer(&r.scene)),
            ("volume", Binding::Image(&r.volume)),
            ("ranges", Binding::Image(&r.ranges)),
        ];
        frame.run_in_slices(&self.0, &bindings, &(), r.ranges.desc.extent)
    }
}
