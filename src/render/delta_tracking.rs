//! Camera paths. One dispatch takes each slot's path a bounded amount of work further; the host
//! sizes that amount so that a dispatch stays far below the two seconds after which Windows resets
//! a GPU, and looks in between whether there is anything left to do.

use std::sync::Arc;
use std::time::Instant;

use bytemuck::Zeroable;

use super::resources::Resources;
use super::shared::{Counters, Features, TrackPush};
use crate::error::Result;
use crate::gpu::{Binding, Device, Frame, Pass, PassDesc, Shaders, Specialization};

/// A dispatch should take about this long.
const TARGET_MS: f64 = 70.0;
const LEAST_WORK: u32 = 16;
/// lavapipe ends loops silently after 65535 iterations of a group of eight threads.
const MOST_WORK: u32 = 4096;

pub struct DeltaTracking {
    pass: Pass,
    /// Loop iterations that a slot makes in the next dispatch.
    work: u32,
    /// As the last dispatch left them.
    counted: Counters,
}

impl DeltaTracking {
    pub fn new(device: &Arc<Device>, shaders: &Shaders, features: &Features) -> Result<Self> {
        let desc = PassDesc {
            name: "delta_tracking",
            specialization: &features.words(),
        };
        Ok(DeltaTracking {
            pass: Pass::new(device, shaders, &desc)?,
            work: LEAST_WORK,
            counted: Counters::zeroed(),
        })
    }

    /// Forgets all paths and starts the queue of pixels anew.
    pub fn restart(&mut self, frame: &mut Frame, r: &Resources) -> Result<()> {
        self.counted = Counters::zeroed();
        frame.run(|f| {
            f.zero(&r.counters)?;
            f.zero(&r.paths)
        })
    }

    /// Takes all paths further. Returns lookups made and whether any path is still on its way.
    pub fn advance(
        &mut self,
        frame: &mut Frame,
        r: &Resources,
        samples: u32,
        first_sample: u32,
    ) -> Result<(u32, bool)> {
        let push = TrackPush {
            samples,
            first_sample,
            work: self.work,
            slots: r.slots(),
        };
        let began = Instant::now();
        frame.run(|f| {
            self.record(f, r, &push)?;
            f.copy(&r.counters, &r.staging)
        })?;
        self.adapt(began.elapsed().as_secs_f64() * 1e3);
        let mapped = r.staging.mapped().unwrap_or_default();
        let counted: Counters = bytemuck::pod_read_unaligned(&mapped[..size_of::<Counters>()]);
        let before = std::mem::replace(&mut self.counted, counted);
        let lookups = counted.lookups.wrapping_sub(before.lookups);
        Ok((lookups, counted.unfinished != before.unfinished))
    }

    fn adapt(&mut self, took_ms: f64) {
        if took_ms < 0.5 * TARGET_MS {
            self.work = (self.work * 2).min(MOST_WORK);
        } else if took_ms > 1.5 * TARGET_MS {
            self.work = (self.work / 2).max(LEAST_WORK);
        }
    }

    fn record(&self, frame: &mut Frame, r: &Resources, push: &TrackPush) -> Result<()> {
        let bindings = [
            ("scene_block", Binding::Buffer(&r.scene)),
            ("volume", r.volume_binding()),
            ("transfer", Binding::Buffer(&r.transfer)),
            ("clips", Binding::Buffer(&r.clips)),
            ("ranges", Binding::Image(&r.ranges)),
            ("majorants", Binding::Image(&r.majorants)),
            ("surfaces", Binding::Buffer(&r.surfaces)),
            ("suns", Binding::Buffer(&r.suns)),
            ("environment", Binding::Image(&r.environment)),
            ("sky", Binding::Buffer(&r.sky)),
            ("paths", Binding::Buffer(&r.paths)),
            ("counters", Binding::Buffer(&r.counters)),
            ("unit_sum", Binding::Image(&r.unit_sum)),
        ];
        frame.pass(&self.pass, &bindings, push, [push.slots, 1, 1])
    }
}
