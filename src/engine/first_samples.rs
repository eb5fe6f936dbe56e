//! The first samples in a variant that is tried: how long they take, how noisy they are, and how evenly they are spread.

use std::time::Instant;

use super::Engine;
use super::forecast::{Evenness, Forecast, left_of};
use super::picture::relative_change;
use super::trial::Work;
use crate::error::Result;
use crate::render::Until;

/// Pixels of the pictures that are tried where the volume is whole: a GPU needs many to be busy.
const PIXELS_CPU: f64 = 4096.0;
const PIXELS_GPU: f64 = 262_144.0;
/// Samples of these pixels that are taken one by one, and then as many in one unit.
const SAMPLES: u32 = 8;
/// Where the volume streams, so many units of one sample are taken together after the first one: those with which a picture
/// begins ([`units_together`](super::schedule::units_together)).
const TOGETHER: [u32; 2] = [3, 12];

/// What units that were begun together have taken.
struct Taken {
    samples: u32,
    seconds: f64,
    /// Those of them in which the device waited for bricks.
    waited: f64,
}

impl Engine {
    /// Takes a few samples; `None` if `until` comes before. They are the beginning of the picture where the volume streams,
    /// and are forgotten otherwise. There, how evenly they are spread is not looked at if the work takes less than `short`
    /// seconds even if they are not, because it takes as long as all of them.
    pub(super) fn try_samples(
        &mut self,
        work: &Work<'_>,
        short: f64,
        until: Until<'_>,
    ) -> Result<Option<Forecast>> {
        match self.renderer.brick_figures() {
            Some(_) => self.try_in_bricks(work, short, until),
            None => self.try_few_pixels(until),
        }
    }

    /// Begins the picture with all its pixels: fewer would need as many bricks, and say little about the time.
    fn try_in_bricks(
        &mut self,
        work: &Work<'_>,
        short: f64,
        until: Until<'_>,
    ) -> Result<Option<Forecast>> {
        // A first sample that is late is better than none.
        if self.take(1, 1, until.interrupt.into())?.is_none() {
            return Ok(None);
        }
        let mut last = None;
        for units in TOGETHER {
            last = self.take(1, units, until)?;
        }
        let Some(last) = last else {
            return Ok(None);
        };
        let variance = self.variance_of_one()?;
        let first = self.forecast(&last, variance, Evenness::NONE);
        if first.seconds_of(work) <= short {
            return Ok(Some(first));
        }
        self.double(1, variance, until)
    }

    /// Takes samples of few pixels.
    fn try_few_pixels(&mut self, until: Until<'_>) -> Result<Option<Forecast>> {
        let size = self.scene.render.size;
        let pixels = |size: [u32; 2]| f64::from(size[0]) * f64::from(size[1]);
        let most = match self.host.summary().kind.is_software() {
            true => PIXELS_CPU,
            false => PIXELS_GPU,
        };
        let scale = (most / pixels(size)).sqrt().min(1.0);
        let small = size.map(|n| ((f64::from(n) * scale) as u32).max(1));
        self.reduce_to(small)?;
        let tried = self.try_whole(until)?;
        self.reduce_to(size)?;
        self.begin_picture();
        let share = pixels(small) / pixels(size);
        Ok(tried.map(|small| Forecast {
            seconds_per_sample: small.seconds_per_sample / share,
            ..small
        }))
    }

    fn try_whole(&mut self, until: Until<'_>) -> Result<Option<Forecast>> {
        self.take(1, 1, until)?;
        self.begin_picture();
        if self.take(1, SAMPLES, until)?.is_none() {
            return Ok(None);
        }
        let variance = self.variance_of_one()?;
        // One unit: small ones wait for their longest path, as only the first of a picture do.
        self.double(SAMPLES, variance, until)
    }

    /// Takes as many samples again as there are, in units of so many, which tells how evenly they are spread; `None` if `until`
    /// comes before. `variance` is that of one sample.
    fn double(
        &mut self,
        in_unit: u32,
        variance: f64,
        until: Until<'_>,
    ) -> Result<Option<Forecast>> {
        let samples = self.totals().samples;
        let before = self.renderer.film()?.mean;
        let Some(taken) = self.take(in_unit, samples / in_unit, until)? else {
            return Ok(None);
        };
        let after = self.renderer.film()?.mean;
        // The spread of single samples, which a march goes by, does not show how even they are.
        let left = match self.renderer.is_marched() {
            true => 1.0,
            false => left_of(
                variance / f64::from(samples),
                relative_change(&before, &after),
            ),
        };
        let evenness = Evenness { samples, left };
        Ok(Some(self.forecast(&taken, variance, evenness)))
    }

    /// Takes units of so many samples, together where the volume streams; `None` if `until` comes before.
    fn take(&mut self, samples: u32, units: u32, until: Until<'_>) -> Result<Option<Taken>> {
        let waited = |engine: &Engine| {
            let figures = engine.renderer.brick_figures();
            figures.map_or(0.0, |bricks| bricks.waited.as_secs_f64())
        };
        let before = (self.totals().samples, waited(self), Instant::now());
        self.renderer.units(samples, units, until)?;
        let taken = Taken {
            samples: self.totals().samples - before.0,
            waited: waited(self) - before.1,
            seconds: before.2.elapsed().as_secs_f64(),
        };
        Ok((taken.samples == samples * units).then_some(taken))
    }

    /// `variance`: that of one sample.
    fn forecast(&self, taken: &Taken, variance: f64, evenness: Evenness) -> Forecast {
        let samples = f64::from(taken.samples);
        // Marched samples, one after another, wait for the same bricks again.
        let waited = match self.renderer.is_marched() {
            true => 0.0,
            false => taken.waited,
        };
        Forecast {
            seconds_per_sample: (taken.seconds - waited) / samples,
            seconds_per_bundle: waited,
            variance,
            evenness,
            cache: None,
        }
    }

    /// Square of the relative error after one sample. What a cache is wrong by is in all samples alike, and is counted with its
    /// filling.
    fn variance_of_one(&mut self) -> Result<f64> {
        let shared = self.renderer.cache().map(|cache| cache.relative_error);
        let shared = shared.filter(|error| error.is_finite()).unwrap_or(0.0);
        let variance = (self.relative_error()?.powi(2) - shared.powi(2)).max(0.0);
        Ok(f64::from(self.totals().samples) * variance)
    }
}
