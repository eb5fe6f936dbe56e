//! The picture at rest by marching, where the cache holds all that is seen.

use std::sync::Arc;

use super::resources::Resources;
use super::shared::{CameraMarchPush, Features};
use crate::error::Result;
use crate::gpu::{
    Binding, Device, Frame, Pass, PassDesc, SLICE_MS, Shaders, Slices, Specialization,
};

pub struct CameraMarch {
    pass: Pass,
    slices: Slices,
    /// How long a piece of work should take.
    pub slice_ms: f64,
}

impl CameraMarch {
    pub fn new(device: &Arc<Device>, shaders: &Shaders, features: &Features) -> Result<Self> {
        let desc = PassDesc {
            name: "camera_march",
            specialization: &features.words(),
            macros: &features.formats(),
        };
        Ok(CameraMarch {
            pass: Pass::new(device, shaders, &desc)?,
            slices: Slices::new(SLICE_MS),
            slice_ms: SLICE_MS,
        })
    }

    /// Takes a sample of every pixel, the `sample_index`-th, a slice further, or begins it. Returns whether
    /// it is in `unit_sum` now.
    pub fn advance(
        &mut self,
        frame: &mut Frame,
        r: &Resources,
        sample_index: u32,
        begins: bool,
    ) -> Result<bool> {
        let Some(cache) = &r.cache else {
            return Ok(true);
        };
        if begins {
            self.slices.restart(self.slice_ms);
        }
        let push = CameraMarchPush { sample_index };
        let bindings = [
            &r.medium_bindings()[..],
            &cache.bindings(),
            &[
                r.camera_binding(),
                ("unit_sum", Binding::Image(&r.unit_sum)),
            ],
        ]
        .concat();
        let threads = [r.size[0], r.size[1], 1];
        frame.run_slice(&self.pass, &bindings, &push, threads, &mut self.slices)
    }

    /// A slice of a sample, which the next one begins anew.
    pub fn warm_up(&mut self, frame: &mut Frame, r: &Resources) -> Result<()> {
        self.advance(frame, r, 0, true).map(drop)
    }
}
