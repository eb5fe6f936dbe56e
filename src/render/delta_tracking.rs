//! Paths from the camera: those of `non-caching`, and those that read the cache.

use std::sync::Arc;

use super::cache_resources::CacheResources;
use super::resources::Resources;
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
            macros: &features.formats(),
        };
        Ok(DeltaTracking {
            pass: Pass::new(device, shaders, &desc)?,
            slots: Slots::new(),
        })
    }

    /// Takes all paths of a unit of `samples` samples a pixel further, the first of them its
    /// `first_sample`-th; or begins it. Once none is under way, their sums are in `unit_sum`.
    pub fn advance(
        &mut self,
        frame: &mut Frame,
        r: &Resources,
        samples: u32,
        first_sample: u32,
        begins: bool,
    ) -> Result<Progress> {
        if begins {
            self.slots.restart(frame, r)?;
        }
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
                &r.medium_bindings()[..],
                &r.surface_bindings(),
                cache.as_ref().map_or(&[], |bindings| &bindings[..]),
                &r.path_bindings(),
                &[
                    r.camera_binding(),
                    ("unit_sum", Binding::Image(&r.unit_sum)),
                ],
            ]
            .concat();
            frame.pass(pass, &bindings, &push, [push.slots, 1, 1])
        })
    }

    /// A few steps of a unit, which the next one begins anew.
    pub fn warm_up(&mut self, frame: &mut Frame, r: &Resources) -> Result<()> {
        self.advance(frame, r, 1, 0, true).map(drop)
    }
}
