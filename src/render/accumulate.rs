//! Folds a unit of samples into the running mean and its spread.

use std::sync::Arc;

use super::resources::Resources;
use super::shared::{AccumulatePush, Features};
use crate::error::Result;
use crate::gpu::{Binding, Device, Frame, Pass, PassDesc, Shaders, Specialization};

pub struct Accumulate(Pass);

impl Accumulate {
    pub fn new(device: &Arc<Device>, shaders: &Shaders, features: &Features) -> Result<Self> {
        let desc = PassDesc {
            name: "accumulate",
            specialization: &features.words(),
            macros: &features.formats(),
        };
        Ok(Accumulate(Pass::new(device, shaders, &desc)?))
    }

    pub fn record(&self, frame: &mut Frame, r: &Resources, push: &AccumulatePush) -> Result<()> {
        let bindings = [
            ("scene_block", Binding::Buffer(&r.scene)),
            ("unit_sum", Binding::Image(&r.unit_sum)),
            ("mean", Binding::Image(&r.mean)),
            ("squares", Binding::Image(&r.squares)),
        ];
        frame.pass(&self.0, &bindings, push, [r.size[0], r.size[1], 1])
    }
}
