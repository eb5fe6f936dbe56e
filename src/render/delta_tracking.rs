//! Paths from the camera: those of `non-caching`, and those that read the cache.

use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};

use super::resources::{CacheResources, Resources};
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

    /// Traces `samples` paths for each pixel, from its `first`-th sample on, and leaves their sums in
    /// `unit_sum`. Returns the reads of the volume; `None` if `stop` is raised before the last path ends.
    pub fn unit(
        &mut self,
        frame: &mut Frame,
        r: &Resources,
        samples: u32,
        first: u32,
        stop: &AtomicBool,
    ) -> Result<Option<u64>> {
        self.slots.restart(frame, r)?;
        let mut lookups = 0;
        loop {
            if stop.load(Ordering::Relaxed) {
                return Ok(None);
            }
            let progress = self.advance(frame, r, samples, first)?;
            lookups += progress.lookups as u64;
            if !progress.under_way {
                return Ok(Some(lookups));
            }
        }
    }

    /// A few steps of a unit, which the next one begins anew.
    pub fn warm_up(&mut self, frame: &mut Frame, r: &Resources) -> Result<()> {
        self.slots.restart(frame, r)?;
        self.advance(frame, r, 1, 0).map(drop)
    }

    fn advance(
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
                &r.medium_bindings()[..],
                &r.surface_bindings(),
                cache.as_ref().map_or(&[], |bindings| &bindings[..]),
                &r.path_bindings(),
                &[("unit_sum", Binding::Image(&r.unit_sum))],
            ]
            .concat();
            frame.pass(pass, &bindings, &push, [push.slots, 1, 1])
        })
    }
}
