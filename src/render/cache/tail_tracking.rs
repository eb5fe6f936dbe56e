//! Paths for the light that a march of the picture at rest leaves to them: that of surfaces, and of the medium
//! where the cache's nodes do not tell it.

use super::memory::CacheMemory;
use crate::error::Result;
use crate::gpu::types::*;
use crate::gpu::{Binding, Frame, Pass, Recording};
use crate::render::pass_compiler::PassCompiler;
use crate::render::path_queue::{Advanced, PathQueue};
use crate::render::resources::Resources;
use crate::shared;

shared! {
    pub struct TailPush {
        /// Index of the sample that has been marched.
        pub sample_index: uint,
        /// Loop iterations after which a slot leaves its path to the next dispatch.
        pub most_iterations: uint,
        pub slots: uint,
    }
}

pub struct TailTracking {
    pass: Pass,
    pub queue: PathQueue,
}

impl TailTracking {
    pub fn new(passes: &PassCompiler<'_>) -> Result<Self> {
        Ok(TailTracking {
            pass: passes.compile::<TailPush>("tail_tracking")?,
            queue: PathQueue::new(passes),
        })
    }

    /// Advances all paths of the sample that has just been marched; they add to `unit_sum`.
    pub fn advance(
        &mut self,
        frame: &mut Frame,
        r: &Resources,
        cache: &CacheMemory,
        sample_index: u32,
    ) -> Result<Advanced> {
        let TailTracking { pass, queue } = self;
        queue.advance(frame, r, pass, |recording, most_iterations| {
            let push = TailPush {
                sample_index,
                most_iterations,
                slots: r.slots(),
            };
            record(pass, recording, r, cache, &push)
        })
    }

    /// Runs the pass without a path, since some drivers finish compiling only then.
    pub fn warm_up(&self, frame: &mut Frame, r: &Resources, cache: &CacheMemory) -> Result<()> {
        let nothing = TailPush {
            sample_index: 0,
            most_iterations: 0,
            slots: 0,
        };
        frame.run(|recording| record(&self.pass, recording, r, cache, &nothing))
    }
}

fn record<'r>(
    pass: &'r Pass,
    recording: &mut Recording<'_, 'r>,
    r: &'r Resources,
    cache: &'r CacheMemory,
    push: &TailPush,
) -> Result<()> {
    let bindings = [
        &r.medium_bindings()[..],
        &r.surface_bindings(),
        &cache.bindings(),
        &r.path_bindings(),
        &[
            r.camera_binding(),
            cache.tails_binding(),
            ("unit_sum", Binding::Image(&r.unit_sum)),
        ],
    ]
    .concat();
    recording.dispatch(pass, &bindings, push, [push.slots.max(1), 1, 1])
}
