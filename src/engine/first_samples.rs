//! The first samples in a variant that is tried: how long they take, how noisy they are, and how evenly they are spread.

use std::time::Instant;

use super::Engine;
use super::forecast::{SampleForecast, VarianceReduction, variance_ratio};
use super::picture::relative_change;
use super::schedule::MOST_AT_ONCE;
use super::task::Task;
use crate::error::Result;
use crate::render::Until;

/// Pixels of the pictures that are tried where the volume is whole: a GPU needs many to be busy.
const PIXELS_CPU: f64 = 4096.0;
const PIXELS_GPU: f64 = 262_144.0;
/// A picture with at most so many times the pixels of a trial is sampled at full size, as its own beginning: samples of fewer
/// pixels would be a large part of the work, and thrown away.
const FEW: f64 = 8.0;
/// Samples of a picture that is tried which are taken one by one, and then as many in one unit; fewer where the picture is
/// marched, whose samples all take about the same time and have little noise.
const SAMPLES: u32 = 8;
const SAMPLES_MARCHED: u32 = 4;
/// The variance of the mean of 32 to 128 marched samples, as a share of that of independent ones, approximately: they are
/// low-discrepancy points, and a better cache makes them less noisy. Few samples do not show that yet
/// (`render/picture/halves.rs`).
const VARIANCE_RATIO_MARCHED: f64 = 0.35;
/// Numbers of one-sample units taken after the first unit when a picture is tried at full size: the bundle sizes with which
/// pictures start where the volume streams ([`units_together`](super::schedule::units_together)); otherwise three.
const UNITS_IN_BRICKS: &[u32] = &[MOST_AT_ONCE, MOST_AT_ONCE * (1 + MOST_AT_ONCE)];
const UNITS: &[u32] = &[3];

/// The cost of units that were begun together.
struct UnitsCost {
    samples: u32,
    seconds: f64,
    /// Those of them in which the device waited for bricks.
    waited: f64,
}

impl Engine {
    /// Takes a few samples of the picture, which are its beginning, or of one with fewer pixels if it has many and the volume
    /// is whole (otherwise fewer would need as many bricks, and say little about the time); `None` if `until` comes before.
    /// How evenly samples are spread is measured only if the work would take `short` seconds or more with independent samples.
    pub(super) fn try_samples(
        &mut self,
        task: &Task<'_>,
        short: f64,
        until: Until<'_>,
    ) -> Result<Option<SampleForecast>> {
        if self.streams() || self.pixels() <= FEW * self.pixels_to_try() {
            self.try_at_full_size(task, short, until)
        } else {
            self.try_few_pixels(self.pixels_to_try(), until)
        }
    }

    pub(super) fn pixels_to_try(&self) -> f64 {
        if self.host.summary().kind.is_software() {
            PIXELS_CPU
        } else {
            PIXELS_GPU
        }
    }

    fn try_at_full_size(
        &mut self,
        task: &Task<'_>,
        short: f64,
        until: Until<'_>,
    ) -> Result<Option<SampleForecast>> {
        if self.take(1, 1, task.until_late())?.is_none() {
            return Ok(None);
        }
        let mut last = None;
        let units = if self.streams() {
            UNITS_IN_BRICKS
        } else {
            UNITS
        };
        for &units in units {
            last = self.take(1, units, until)?;
        }
        let Some(last) = last else {
            return Ok(None);
        };
        let variance = self.variance_of_one()?;
        let first = self.forecast(&last, variance, VarianceReduction::NONE);
        if self.renderer.is_marched() || first.seconds_of(task) <= short {
            Ok(Some(first))
        } else {
            self.double(1, variance, until)
        }
    }

    /// Takes samples of a picture with about so many pixels, and forgets them; `None` if `until` comes before.
    pub(super) fn try_few_pixels(
        &mut self,
        pixels: f64,
        until: Until<'_>,
    ) -> Result<Option<SampleForecast>> {
        let size = self.scene.render.size;
        let scale = (pixels / self.pixels()).sqrt();
        let small = size.map(|n| ((f64::from(n) * scale) as u32).max(1));
        let view = self.renderer.caching().map(|mut c| c.take_view_state());
        self.reduce_to(small)?;
        let tried = self.try_small_picture(until)?;
        self.reduce_to(size)?;
        if let Some((mut caching, view)) = self.renderer.caching().zip(view) {
            caching.put_back(view);
        }
        self.begin_picture();
        let share = small.map(f64::from).iter().product::<f64>() / self.pixels();
        Ok(tried.map(|small| SampleForecast {
            seconds_per_sample: small.seconds_per_sample / share,
            ..small
        }))
    }

    /// Takes samples of all pixels, and forgets them; `None` if `until` comes before.
    pub(super) fn try_all_pixels(&mut self, until: Until<'_>) -> Result<Option<SampleForecast>> {
        let tried = self.try_picture(until)?;
        self.begin_picture();
        Ok(tried)
    }

    /// Seconds that trying all pixels will take if a sample takes as long as `samples` says.
    pub(super) fn seconds_to_try(&self, samples: &SampleForecast) -> f64 {
        2.0 * f64::from(self.samples_one_by_one()) * samples.seconds_per_sample
    }

    fn samples_one_by_one(&self) -> u32 {
        if self.renderer.is_marched() {
            SAMPLES_MARCHED
        } else {
            SAMPLES
        }
    }

    fn try_small_picture(&mut self, until: Until<'_>) -> Result<Option<SampleForecast>> {
        self.take(1, 1, until)?;
        self.begin_picture();
        self.try_picture(until)
    }

    fn try_picture(&mut self, until: Until<'_>) -> Result<Option<SampleForecast>> {
        let samples = self.samples_one_by_one();
        if self.take(1, samples, until)?.is_none() {
            return Ok(None);
        }
        let variance = self.variance_of_one()?;
        // All in one unit, since each unit waits for its longest path, and a picture at full size has such small units only at
        // its beginning.
        self.double(samples, variance, until)
    }

    /// Takes as many samples again as there are, in units of so many, which tells how evenly they are spread; `None` if `until`
    /// comes before. `variance` is that of one sample.
    fn double(
        &mut self,
        in_unit: u32,
        variance: f64,
        until: Until<'_>,
    ) -> Result<Option<SampleForecast>> {
        let samples = self.totals().samples;
        let before = self.renderer.film()?.mean;
        let Some(cost) = self.take(in_unit, samples / in_unit, until)? else {
            return Ok(None);
        };
        let after = self.renderer.film()?.mean;
        let ratio = variance_ratio(
            variance / f64::from(samples),
            relative_change(&before, &after),
        );
        let reduction = VarianceReduction { samples, ratio };
        Ok(Some(self.forecast(&cost, variance, reduction)))
    }

    /// Takes units of so many samples, together where the volume streams; `None` if `until` comes before.
    fn take(&mut self, samples: u32, units: u32, until: Until<'_>) -> Result<Option<UnitsCost>> {
        let (before, waited) = (self.totals().samples, self.waited_for_bricks());
        let began = Instant::now();
        self.renderer.units(samples, units, until)?;
        let cost = UnitsCost {
            samples: self.totals().samples - before,
            waited: (self.waited_for_bricks() - waited).as_secs_f64(),
            seconds: began.elapsed().as_secs_f64(),
        };
        Ok((cost.samples == samples * units).then_some(cost))
    }

    /// `variance`: that of one sample.
    fn forecast(
        &self,
        cost: &UnitsCost,
        variance: f64,
        reduction: VarianceReduction,
    ) -> SampleForecast {
        let samples = f64::from(cost.samples);
        if self.renderer.is_marched() {
            SampleForecast {
                // One after another, samples wait for the same bricks again.
                seconds_per_sample: cost.seconds / samples,
                seconds_per_bundle: 0.0,
                variance: VARIANCE_RATIO_MARCHED * variance,
                reduction: VarianceReduction::NONE,
            }
        } else {
            SampleForecast {
                seconds_per_sample: (cost.seconds - cost.waited) / samples,
                seconds_per_bundle: cost.waited,
                variance,
                reduction,
            }
        }
    }

    /// Square of the relative error after one sample. What a cache is wrong by is in all samples alike, and is counted with its
    /// filling.
    fn variance_of_one(&mut self) -> Result<f64> {
        let shared = self
            .renderer
            .cache()
            .map(|cache| cache.filling.error_at_rest);
        let shared = shared.filter(|error| error.is_finite()).unwrap_or(0.0);
        let variance = (self.sure_error()?.powi(2) - shared.powi(2)).max(0.0);
        Ok(f64::from(self.totals().samples) * variance)
    }
}
