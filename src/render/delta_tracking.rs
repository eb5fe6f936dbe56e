//! Paths from the camera.

use std::sync::Arc;

use super::resources::Resources;
use super::shared::{Features, TrackPush};
use super::slots::{Progress, Slots};
use crate::error::Result;
use crate::gpu::{Binding, Device, Frame, Pass, PassDesc, Shaders, Specialization};

pub struct DeltaTracking {
    pass: Pass,
    slots: Slots,
}

impl DeltaTracking {
    pub fn new(device: &Arc<Device>, shaders: &Shaders, features: &Features) -> Result<Self> {
        let desc = PassDesc {
            name: "delta_tracking",
            specialization: &features.words(),
        };
        Ok(DeltaTracking {
            pass: Pass::new(device, shaders, &desc)?,
            slots: Slots::new(),
        })
    }

    /// Forgets all paths and starts the queue of pixels anew.
    pub fn restart(&mut self, frame: &mut Frame, r: &Resources) -> Result<()> {
        self.slots.restart(frame, r)
    }

    /// Takes all paths of a unit of `samples` samples a pixel further.
    pub fn advance(
        &mut self,
        frame: &mut Frame,
        r: &Resources,
        samples: u32,
        first_sample: u32,
    ) -> Result<Progress> {
        let DeltaTracking { pass, slots } = self;
        slots.advance(frame, r, |frame, work| {
            let push = TrackPush {
                samples,
                first_sample,
                work,
                slots: r.slots(),
            };
            let bindings = [
                &r.march_bindings()[..],
                &r.cache_bindings(),
                &r.path_bindings(),
                &[("unit_sum", Binding::Image(&r.unit_sum))],
            ]
            .concat();
            frame.pass(pass, &bindings, &push, [push.slots, 1, 1])
        })
    }
}
