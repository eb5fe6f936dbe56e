//! The picture at rest by marching, where light may be read from the cache at the first collision.

use super::memory::CacheMemory;
use super::tail_tracking::TailTracking;
use crate::error::Result;
use crate::gpu::types::*;
use crate::gpu::{Binding, Dispatch, Frame, Pass, SLICE_MS};
use crate::render::bricks::Items;
use crate::render::pass_compiler::PassCompiler;
use crate::render::picture::bundle::{Bundle, BundleProgress};
use crate::render::resources::Resources;
use crate::render::volume_reading::ReadingSlices;
use crate::shared;

shared! {
    pub struct CameraMarchPush {
        /// Index of the sample that every pixel gets.
        pub sample_index: uint,
    }
}

pub struct CameraMarch {
    pass: Pass,
    /// `None` where no light can be left to paths.
    tails: Option<Tails>,
    slices: ReadingSlices,
    /// Pixels, in the order of work, that have all of their units.
    pixels: u32,
    stage: Stage,
}

/// The light that is left to paths.
struct Tails {
    tracking: TailTracking,
    /// The share of the cache's nodes near which light is left to them; 1 where there are surfaces.
    left_share: f64,
}

/// What the pixels under way need next.
#[derive(Clone, Copy, PartialEq, Eq)]
enum Stage {
    March,
    Tails,
}

impl CameraMarch {
    pub fn new(passes: &PassCompiler<'_>) -> Result<Self> {
        // The shader of paths takes longer to compile than that of the march.
        let (tails, pass) = rayon::join(
            || {
                if passes.features.has_tails {
                    TailTracking::new(passes).map(Some)
                } else {
                    Ok(None)
                }
            },
            || passes.compile::<CameraMarchPush>("camera_march"),
        );
        Ok(CameraMarch {
            pass: pass?,
            tails: tails?.map(|tracking| Tails {
                tracking,
                left_share: 1.0,
            }),
            slices: ReadingSlices::new(SLICE_MS),
            pixels: 0,
            stage: Stage::March,
        })
    }

    /// Light is left to paths near this share of the cache's nodes from now on.
    pub fn set_left_share(&mut self, share: f64) {
        if let Some(tails) = &mut self.tails {
            tails.left_share = share;
        }
    }

    /// Whether next to no light is left to paths.
    pub fn leaves_next_to_nothing(&self) -> bool {
        const NEXT_TO_NOTHING: f64 = 0.02;
        self.tails
            .as_ref()
            .is_none_or(|tails| tails.left_share < NEXT_TO_NOTHING)
    }

    /// Advances a bundle of units of one sample by a slice, or begins it: first as many pixels, with all of their
    /// units, as `unit_sum` has room for, and then the next.
    pub fn advance(
        &mut self,
        frame: &mut Frame,
        r: &Resources,
        cache: &CacheMemory,
        bundle: Bundle,
    ) -> Result<BundleProgress> {
        if bundle.begins {
            self.begin_pixels(frame, 0);
        }
        let items = bundle.items_from(self.pixels, r.size);
        let mut lookups = 0;
        let are_done = match &mut self.tails {
            Some(tails) if self.stage == Stage::Tails => {
                let first_sample = bundle.first_sample;
                let progress = tails.tracking.advance(frame, r, cache, first_sample)?;
                lookups = progress.lookups;
                !progress.under_way
            }
            _ => self.march(frame, r, cache, bundle.first_sample, items)?,
        };
        if are_done {
            self.begin_pixels(frame, items.end / bundle.units);
        }
        Ok(BundleProgress {
            pixels: self.pixels,
            lookups,
        })
    }

    /// Runs `tail_tracking` once without paths, if there is such a pass: the first slice of a sample only marches, and some
    /// drivers finish compiling a pass only when it first runs.
    pub fn warm_up(&self, frame: &mut Frame, r: &Resources, cache: &CacheMemory) -> Result<()> {
        match &self.tails {
            Some(tails) => tails.tracking.warm_up(frame, r, cache),
            None => Ok(()),
        }
    }

    /// Goes on with the pixels behind the first `pixels`.
    fn begin_pixels(&mut self, frame: &Frame, pixels: u32) {
        self.pixels = pixels;
        self.slices.restart(frame.slice_ms);
        self.stage = Stage::March;
    }

    /// States the samples that its marches have taken since this was last done.
    pub fn collect(&self, frame: &mut Frame, r: &Resources, cache: &CacheMemory) -> Result<()> {
        cache
            .marched_at_rest
            .collect(frame, &r.staging, self.pass.name)
    }

    /// Marches a slice of the pixels. Returns whether they have all of their light: the slice was the last, and no light is
    /// left to paths.
    fn march(
        &mut self,
        frame: &mut Frame,
        r: &Resources,
        cache: &CacheMemory,
        sample_index: u32,
        items: Items,
    ) -> Result<bool> {
        let [width, height] = r.size;
        let bindings = [
            &r.medium_bindings()[..],
            &r.surface_bindings(),
            &cache.bindings(),
            &[
                r.camera_binding(),
                ("unit_sum", Binding::Image(&r.unit_sum)),
                cache.tails_binding(),
                cache.marched_at_rest.binding(),
            ],
        ]
        .concat();
        let dispatch = Dispatch {
            pass: &self.pass,
            bindings,
            push: CameraMarchPush { sample_index },
            threads: [width, height, 1],
        };
        if let Some(bricks) = &r.bricks {
            bricks.allow(items);
        }
        let is_last = r.run_slice(frame, &dispatch, &mut self.slices, |_| Ok(()))?;
        match &mut self.tails {
            Some(tails) if is_last && tails.left_share > 0.0 => {
                tails.tracking.queue.restart(frame, r, items)?;
                self.stage = Stage::Tails;
                Ok(false)
            }
            _ => Ok(is_last),
        }
    }
}
