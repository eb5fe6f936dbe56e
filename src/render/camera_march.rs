//! The picture at rest by marching, where the cache holds all that is seen.

use std::sync::Arc;

use super::resources::{CacheResources, Resources};
use super::shared::{CameraMarchPush, Features};
use crate::error::Result;
use crate::gpu::{Binding, Device, Frame, Pass, PassDesc, Shaders, Specialization};

pub struct CameraMarch(Pass);

impl CameraMarch {
    pub fn new(device: &Arc<Device>, shaders: &Shaders, features: &Features) -> Result<Self> {
        let desc = PassDesc {
            name: "camera_march",
            specialization: &features.words(),
        };
        Ok(CameraMarch(Pass::new(device, shaders, &desc)?))
    }

    /// Leaves one sample of every pixel, its so-manieth, in `unit_sum`.
    pub fn run(
        &self,
        frame: &mut Frame,
        r: &Resources,
        cache: &CacheResources,
        sample_index: u32,
    ) -> Result<()> {
        let push = CameraMarchPush { sample_index };
        let bindings = [
            &r.medium_bindings()[..],
            &cache.bindings(),
            &[("unit_sum", Binding::Image(&r.unit_sum))],
        ]
        .concat();
        let [width, height, _] = r.unit_sum.desc.extent;
        frame.run_in_slices(&self.0, &bindings, &push, [width, height, 1])
    }
}
