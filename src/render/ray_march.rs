//! The picture that the cache shows at once.

use std::sync::Arc;

use super::resources::{CacheResources, Resources};
use super::shared::{Features, MarchPush};
use crate::error::Result;
use crate::gpu::{Binding, Device, Frame, Pass, PassDesc, Shaders, Specialization};

/// A transmittance behind which nothing can be seen in eight bits.
const OPAQUE_BELOW: f32 = 1e-3;

pub struct RayMarch(Pass);

impl RayMarch {
    pub fn new(device: &Arc<Device>, shaders: &Shaders, features: &Features) -> Result<Self> {
        let desc = PassDesc {
            name: "ray_march",
            specialization: &features.words(),
        };
        Ok(RayMarch(Pass::new(device, shaders, &desc)?))
    }

    /// Leaves the picture in `unit_sum`.
    pub fn run(&self, frame: &mut Frame, r: &Resources, cache: &CacheResources) -> Result<()> {
        self.dispatch(frame, r, cache, 1, false)
    }

    /// Leaves what the cache's error is measured by (`MarchPush::measures`), for every `stride`-th pixel
    /// along both axes, in the corner of `unit_sum`.
    pub fn measure(
        &self,
        frame: &mut Frame,
        r: &Resources,
        cache: &CacheResources,
        stride: u32,
    ) -> Result<()> {
        self.dispatch(frame, r, cache, stride, true)
    }

    fn dispatch(
        &self,
        frame: &mut Frame,
        r: &Resources,
        cache: &CacheResources,
        stride: u32,
        measures: bool,
    ) -> Result<()> {
        let push = MarchPush {
            stride,
            opaque_below: OPAQUE_BELOW,
            measures: measures as u32,
        };
        let bindings = [
            &r.medium_bindings()[..],
            &r.surface_bindings(),
            &cache.bindings(),
            &[("unit_sum", Binding::Image(&r.unit_sum))],
        ]
        .concat();
        let [width, height, _] = r.unit_sum.desc.extent;
        let threads = [width.div_ceil(stride), height.div_ceil(stride), 1];
        frame.run_in_slices(&self.0, &bindings, &push, threads)
    }
}
