//! Paths from the camera: those of `non-caching`, and those that read the cache.

use super::pass_compiler::PassCompiler;
use super::path_queue::PathQueue;
use super::resources::Resources;
use super::shared::TrackPush;
use super::unit::{Sampled, Unit};
use crate::error::Result;
use crate::gpu::{Binding, Frame, Pass};

pub struct DeltaTracking {
    pass: Pass,
    pub queue: PathQueue,
}

impl DeltaTracking {
    /// Paths that find all light by themselves.
    pub fn new(passes: &PassCompiler<'_>) -> Result<Self> {
        DeltaTracking::with_shader(passes, "delta_tracking")
    }

    /// Paths that end where they can read the cache.
    pub fn through_cache(passes: &PassCompiler<'_>) -> Result<Self> {
        DeltaTracking::with_shader(passes, "cached_tracking")
    }

    fn with_shader(passes: &PassCompiler<'_>, name: &'static str) -> Result<Self> {
        Ok(DeltaTracking {
            pass: passes.compile(name)?,
            queue: PathQueue::new(passes),
        })
    }

    /// Takes all paths of a unit further, or begins it. Once none is under way, their sums are in `unit_sum`. `cache`
    /// is what reading the cache takes; it is empty for paths that do not.
    pub fn advance(
        &mut self,
        frame: &mut Frame,
        r: &Resources,
        cache: &[(&'static str, Binding<'_>)],
        unit: Unit,
    ) -> Result<Sampled> {
        if unit.begins {
            self.queue.restart(frame, r)?;
        }
        let Unit {
            samples,
            first_sample,
            ..
        } = unit;
        let DeltaTracking { pass, queue } = self;
        let progress = queue.advance(frame, r, pass, |frame, work| {
            let push = TrackPush {
                samples,
                first_sample,
                work,
                slots: r.slots(),
            };
            let bindings = [
                &r.medium_bindings()[..],
                &r.surface_bindings(),
                cache,
                &r.path_bindings(),
                &[
                    r.camera_binding(),
                    ("unit_sum", Binding::Image(&r.unit_sum)),
                ],
            ]
            .concat();
            frame.pass(pass, &bindings, &push, [push.slots, 1, 1])
        })?;
        Ok(Sampled {
            ended: (!progress.under_way).then_some(samples),
            lookups: progress.lookups,
        })
    }
}
