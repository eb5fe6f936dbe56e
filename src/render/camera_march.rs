//! The picture at rest by marching, where the cache holds all that is seen.

use super::cache_memory::CacheMemory;
use super::pass_compiler::PassCompiler;
use super::resources::Resources;
use super::shared::CameraMarchPush;
use super::unit::{Sampled, Unit};
use crate::error::Result;
use crate::gpu::{Binding, Frame, Pass, SLICE_MS, Slices};

pub struct CameraMarch {
    pass: Pass,
    slices: Slices,
    /// How long a piece of work should take.
    pub slice_ms: f64,
}

impl CameraMarch {
    pub fn new(passes: &PassCompiler<'_>) -> Result<Self> {
        Ok(CameraMarch {
            pass: passes.compile("camera_march")?,
            slices: Slices::new(SLICE_MS),
            slice_ms: SLICE_MS,
        })
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
        }
        let push = CameraMarchPush {
            sample_index: unit.first_sample,
        };
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
        let is_last = frame.run_slice(&self.pass, &bindings, &push, threads, &mut self.slices)?;
        Ok(Sampled {
            ended: is_last.then_some(1),
            lookups: 0,
        })
    }
}
