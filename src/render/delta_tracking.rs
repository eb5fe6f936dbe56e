//! Paths from the camera: those of `non-caching`, and those that read the cache.

use std::sync::Arc;

use super::resources::{CacheResources, Resources};
use super::shared::{Features, TrackPush};
use super::slots::{Progress, Slots};
use crate::error::Result;
use crate::gpu::{Binding, Device, Frame, Pass, PassDesc, Shaders, Specialization};

pub struct DeltaTracking {
    pass: Pass,
    pub slots: Slots,
}

impl DeltaTracking {
    pub fn new(device: &Arc<Device>, shaders: &Shaders, features: &Features) -> Result<Self> {
        let desc = PassDesc {
            name: match features.cache_order {
                0 => "delta_tracking",
                _ => "cached_tracking",
            },
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
            let cache = r.cache.as_ref().map(CacheResources::bindings);
            let bindings = [
                &r.march_bindings()[..],
                cache.as_ref().map_or(&[], |bindings| &bindings[..]),
                &r.path_bindings(),
                &[("unit_sum", Binding::Image(&r.unit_sum))],
            ]
            .concat();
            frame.pass(pass, &bindings, &push, [push.slots, 1, 1])
        })
    }
}
