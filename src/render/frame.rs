//! A frame, from top to bottom.
//!
//! 1. [`prepare`](Renderer::prepare): what a change of the scene has invalidated is computed again, from majorants to the
//!    marks of the cache's cubes.
//! 2. [`Caching::advance`](super::Caching::advance): where there is a cache, a slice of a batch of paths from its nodes.
//! 3. [`advance_units`](Renderer::advance_units): a slice of a unit of samples, by the estimator of the variant.
//! 4. [`accumulate`](Renderer::accumulate): units that have ended are folded into the mean.
//! 5. [`complete_mean`](Renderer::complete_mean) and [`see_first_surfaces`](Renderer::see_first_surfaces), before the picture
//!    and its layers are read; [`tone_map`](Renderer::tone_map), before it is shown.
//!
//! Steps 2 and 3 are repeated, in the order and as often as the engine wants.

use super::estimator::Estimator;
use super::parts::{Changes, Derived, Display};
use super::picture::accumulate::AccumulatePush;
use super::picture::bundle::{Bundle, BundleProgress, BundleUnderWay};
use super::picture::under_way::UnderWay;
use super::renderer::Renderer;
use crate::error::{Error, Result};
use crate::gpu::Image;

impl Renderer {
    /// Recomputes what depends on those parts of the scene that have changed.
    pub(super) fn prepare(&mut self, changes: Changes) -> Result<()> {
        let (frame, r) = (&mut self.frame, &mut self.resources);
        let blocks = self.scene.blocks();
        if changes.invalidates(Derived::Majorants) && !self.scene.parts.medium.is_vacuum() {
            self.passes.majorants.run(frame, r, blocks)?;
        }
        if changes.invalidates(Derived::Patches) {
            self.passes.patches.run(frame, r, blocks)?;
        }
        if let Estimator::Caching(cache) = &mut self.estimator {
            cache.prepare(frame, r, &self.scene, changes)?;
        }
        if changes.invalidates(Derived::Picture) {
            self.begin_picture();
        }
        Ok(())
    }

    /// Goes on with a bundle of units for a slice of time, or begins one. Returns whether it has ended.
    pub(super) fn advance_units(&mut self, samples: u32, units: u32) -> Result<bool> {
        self.clear_if_stale()?;
        let mut under_way = match std::mem::take(&mut self.under_way) {
            UnderWay::Units(under_way) => under_way,
            UnderWay::Rays(_) | UnderWay::Nothing => self.begin_bundle(samples, units)?,
        };
        let (frame, r) = (&mut self.frame, &self.resources);
        let bundle = under_way.bundle;
        let sampled = match &mut self.estimator {
            Estimator::NonCaching(tracking) => tracking.advance(frame, r, &[], bundle),
            Estimator::Caching(cache) => cache.sample(frame, r, bundle),
            Estimator::Published(published) => {
                published.round(frame, r, &mut self.totals)?;
                return Ok(true);
            }
        };
        match sampled.and_then(|sampled| self.take_in(&mut under_way, sampled)) {
            Ok(pixels) if pixels == self.pixels() => {
                self.totals.count(&under_way, pixels);
                self.update_halves()?;
                Ok(true)
            }
            Ok(_) => {
                self.under_way = UnderWay::Units(under_way);
                Ok(false)
            }
            Err(error) => {
                // Some pixels may have units in the mean that others lack.
                self.under_way = UnderWay::Units(under_way);
                match (error, self.abandon()) {
                    // After a lost device nothing can be restored: what was lost first is to be reported.
                    (Error::Device(first), _) => Err(first.into()),
                    (first, restored) => restored.and(Err(first)),
                }
            }
        }
    }

    /// Adds what a slice has sampled to the bundle under way, and folds what has ended into the mean. Returns the number of
    /// pixels that have all units of the bundle.
    fn take_in(&mut self, under_way: &mut BundleUnderWay, progress: BundleProgress) -> Result<u32> {
        under_way.bundle.begins = false;
        under_way.lookups += u64::from(progress.lookups);
        self.accumulate(under_way, progress.pixels)?;
        Ok(progress.pixels)
    }

    fn begin_bundle(&mut self, samples: u32, units: u32) -> Result<BundleUnderWay> {
        // Samples use the memory of a batch's paths: a batch under way is dropped.
        if let Estimator::Caching(cache) = &mut self.estimator {
            cache.abandon();
        }
        let before = match units {
            1 => None,
            _ => Some(self.sums()?),
        };
        let bundle = Bundle {
            samples: if self.is_marched() { 1 } else { samples },
            units,
            first_sample: self.totals.first_sample + self.totals.samples,
            begins: true,
        };
        Ok(BundleUnderWay {
            bundle,
            folded: 0,
            lookups: 0,
            before,
        })
    }

    /// Folds the units under way of all pixels before `pixels` into the picture; these pixels have all of the units. A single
    /// unit is folded only once every pixel has it, so that it can still be dropped.
    fn accumulate(&mut self, under_way: &mut BundleUnderWay, pixels: u32) -> Result<()> {
        let Bundle { samples, units, .. } = under_way.bundle;
        if pixels == under_way.folded || (units == 1 && pixels < self.pixels()) {
            return Ok(());
        }
        let push = AccumulatePush {
            samples,
            samples_before: self.totals.samples,
            first: under_way.folded,
            end: pixels,
        };
        let r = &self.resources;
        self.frame
            .run(|recording| self.passes.accumulate.record(recording, r, units, &push))?;
        under_way.folded = pixels;
        Ok(())
    }

    fn clear_if_stale(&mut self) -> Result<()> {
        let r = &self.resources;
        if std::mem::take(&mut self.is_stale) {
            self.frame
                .run(|recording| recording.clear(&[&r.mean, &r.squares]))
        } else {
            Ok(())
        }
    }

    /// Brings the mean up to date for being read.
    pub(super) fn complete_mean(&mut self) -> Result<()> {
        self.clear_if_stale()?;
        let (frame, r) = (&mut self.frame, &self.resources);
        match &self.estimator {
            Estimator::Published(published) => published.march(frame, r),
            Estimator::Caching(cache) => cache.collect(frame, r),
            Estimator::NonCaching(_) => Ok(()),
        }
    }

    /// Finds the surfaces behind the pixels' centres, for the picture's other layers.
    pub(super) fn see_first_surfaces(&mut self) -> Result<()> {
        match &self.passes.iso_depth {
            Some(pass) => pass.run(&mut self.frame, &self.resources),
            None => Ok(()),
        }
    }

    /// Encodes the mean so far for display.
    pub fn tone_map(&mut self, to: &Image, display: Display) -> Result<()> {
        let (r, tone_map) = (&self.resources, &self.passes.tone_map);
        self.frame
            .run(|recording| tone_map.record(recording, &r.mean, r.size, to, display))
    }
}
