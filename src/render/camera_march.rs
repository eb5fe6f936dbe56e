//! The picture at rest by marching, where the cache holds all that is seen.

use super::cache_memory::CacheMemory;
use super::pass_compiler::PassCompiler;
use super::resources::Resources;
use super::shared::CameraMarchPush;
use super::tail_tracking::TailTracking;
use super::unit::{Sampled, Unit};
use crate::error::Result;
use crate::gpu::{Binding, Frame, Pass, SLICE_MS, Slices};

pub struct CameraMarch {
    pass: Pass,
    /// Only where there are surfaces.
    tails: Option<TailTracking>,
    slices: Slices,
    /// How long a piece of work should take.
    slice_ms: f64,
    is_marched: bool,
}

impl CameraMarch {
    pub fn new(passes: &PassCompiler<'_>) -> Result<Self> {
        // Paths take longer to compile than a march.
        let (tails, pass) = rayon::join(
            || match passes.features.has_tails() {
                true => TailTracking::new(passes).map(Some),
                false => Ok(None),
            },
            || passes.compile("camera_march"),
        );
        Ok(CameraMarch {
            pass: pass?,
            tails: tails?,
            slices: Slices::new(SLICE_MS),
            slice_ms: SLICE_MS,
            is_marched: false,
        })
    }

    /// How long a piece of work should take from now on.
    pub fn take_slices_of(&mut self, ms: f64) {
        self.slice_ms = ms;
        if let Some(tails) = &mut self.tails {
            tails.queue.target_ms = ms;
        }
    }

    /// Takes one sample of every pixel, the unit's first, a slice further, or begins it. The unit ends with that
    /// sample, however many it was to have: a march knows the spread between single ones.
    pub fn advance(
        &mut self,
        frame: &mut Frame,
        r: &Resources,
        cache: &CacheMemory,
        unit: Unit,
    ) -> Result<Sampled> {
        if unit.begins {
            self.slices.restart(self.slice_ms);
            self.is_marched = false;
        }
        if self.is_marched
            && let Some(tails) = &mut self.tails
        {
            return tails.advance(frame, r, cache, unit.first_sample);
        }
        let push = CameraMarchPush {
            sample_index: unit.first_sample,
        };
        let bindings = [
            &r.medium_bindings()[..],
            &r.surface_bindings(),
            &cache.bindings(),
            &[
                r.camera_binding(),
                ("unit_sum", Binding::Image(&r.unit_sum)),
                cache.tails_binding(),
            ],
        ]
        .concat();
        let threads = [r.size[0], r.size[1], 1];
        self.is_marched = r.run_slice(
            frame,
            &self.pass,
            &bindings,
            &push,
            threads,
            &mut self.slices,
        )?;
        if self.is_marched
            && let Some(tails) = &mut self.tails
        {
            tails.queue.restart(frame, r)?;
        }
        Ok(Sampled {
            ended: (self.is_marched && self.tails.is_none()).then_some(1),
            lookups: 0,
        })
    }
}
