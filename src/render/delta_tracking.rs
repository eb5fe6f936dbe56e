//! Paths from the camera: those of `non-caching`, and those that read the cache.

use super::bricks::Items;
use super::pass_compiler::PassCompiler;
use super::path_queue::PathQueue;
use super::picture::bundle::{Bundle, BundleProgress};
use super::resources::Resources;
use crate::error::Result;
use crate::gpu::types::*;
use crate::gpu::{Binding, Frame, Pass};
use crate::shared;

shared! {
    pub struct TrackPush {
        /// Samples that each pixel gets before the queue is empty.
        pub samples: uint,
        /// Index of the first of these samples.
        pub first_sample: uint,
        /// Loop iterations after which a slot leaves its path to the next dispatch.
        pub most_iterations: uint,
        pub slots: uint,
    }
}

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
            pass: passes.compile::<TrackPush>(name)?,
            queue: PathQueue::new(passes),
        })
    }

    /// Advances all paths of a bundle, or begins it. `cache` has the resources for reading the cache; it is empty for
    /// paths that do not read it.
    pub fn advance(
        &mut self,
        frame: &mut Frame,
        r: &Resources,
        cache: &[(&'static str, Binding<'_>)],
        bundle: Bundle,
    ) -> Result<BundleProgress> {
        if bundle.begins {
            let items = bundle.items_from(0, r.size);
            self.queue.restart(frame, r, items)?;
        }
        let Bundle {
            samples,
            first_sample,
            ..
        } = bundle;
        let DeltaTracking { pass, queue } = self;
        let progress = queue.advance(frame, r, pass, |recording, most_iterations| {
            let push = TrackPush {
                samples,
                first_sample,
                most_iterations,
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
            recording.dispatch(pass, &bindings, &push, [push.slots, 1, 1])
        })?;
        let all = r.size[0] * r.size[1];
        let pixels = match &r.bricks {
            Some(bricks) => {
                let pixels = (progress.first_item / bundle.units).min(all);
                bricks.allow(Items {
                    // The queue's numbers begin with the bundle's first item.
                    first: 0,
                    ..bundle.items_from(pixels, r.size)
                });
                pixels
            }
            None if progress.under_way => 0,
            None => all,
        };
        Ok(BundleProgress {
            pixels,
            lookups: progress.lookups,
        })
    }
}
