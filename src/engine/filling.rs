//! Filling a cache before samples are taken, batch after batch, and how far.
//!
//! The cache's error is the same in all samples, while the noise of samples falls with their number. So the time is divided
//! between filling and sampling by what each gains from it (`forecast/`). Gathering takes little time and is always worth
//! it. Before batches of traced paths, a trial with few pixels measures the noise and the time of samples. Few pixels are
//! large ones, and much of the noise of marched samples is what differs within a pixel: of a cloud, an eighth of the pixels
//! have four times the variance. So the trial is repeated with all pixels once that takes little time beside the filling.

use std::time::{Duration, Instant};

use super::Engine;
use super::batches::{Filled, cache_goal, cache_share_of_time, next_batch};
use super::forecast::{CachedForecast, FillForecast, SampleForecast};
use super::run::{Progress, Run};
use super::stop::Stop;
use crate::error::Result;
use crate::render::shared::GATHERED;
use crate::render::{Batch, Until, equivalent_paths};

/// Nodes that gather share the errors of the light that they read, which the change from batch to batch does not show.
/// Until batches trace paths to their ends, the measured variance of the cache is multiplied by this.
const UNSEEN_WHILE_GATHERING: f64 = 5.0;
/// The samples that are tried first have this share of the picture's pixels, at most.
const SHARE_OF_PIXELS: f64 = 0.125;
/// Samples of all pixels are tried once the filling has taken so many times as long as they will.
const LITTLE_TIME: f64 = 20.0;

/// Samples through the cache that were tried before the picture had any.
#[derive(Clone, Copy)]
pub(super) struct SamplesAhead {
    forecast: SampleForecast,
    are_of_all_pixels: bool,
}

impl Engine {
    /// Fills the cache, batch after batch, until it is good enough for the run's `pictures` pictures. Returns whether
    /// it is; if not, an interruption or the run's time has ended it in the middle of a batch.
    pub fn fill(&mut self, run: &mut Run<'_>, pictures: u32) -> Result<bool> {
        let began = Instant::now();
        let spent_before = self
            .renderer
            .cache()
            .map_or(Duration::ZERO, |cache| cache.filling.took);
        let is_caught_up = |engine: &Engine| {
            let cache = engine.renderer.cache();
            cache.is_some_and(|cache| cache.filling.updates == 0 || cache.is_caught_up())
        };
        let mut is_of_another_view = !is_caught_up(self);
        loop {
            let updates = self.updates();
            is_of_another_view &= !is_caught_up(self);
            let spent = spent_before + began.elapsed();
            let until = match updates {
                0 if run.waits => run.until(None, spent),
                0 => run.until(run.stop.late(), spent),
                // What has come in sight has had no path, and time that earlier views took does not count.
                _ if is_of_another_view => run.until(run.stop.late(), Duration::ZERO),
                _ => run.until(run.stop.time, spent),
            };
            let mut next = self.next_batch(&run.stop, pictures);
            if next.is_some() && self.try_samples_ahead(&run.stop, until)? {
                next = self.next_batch(&run.stop, pictures);
            }
            let Some((batch, mut caching)) = next.zip(self.renderer.caching()) else {
                return Ok(true);
            };
            if !caching.batch(batch, until)? {
                return Ok(false);
            }
            if let Some(cache) = self.renderer.cache()
                && batch != Batch::CatchUp
            {
                (run.progress)(Progress::Batch {
                    updates: cache.filling.updates,
                    relative_error: cache.filling.relative_error,
                });
            }
            run.call_between(self)?;
        }
    }

    /// The next batch; `None` if the cache is good enough, or there is none. Nodes that have come in sight catch up first.
    fn next_batch(&self, stop: &Stop, pictures: u32) -> Option<Batch> {
        let cache = self.renderer.cache()?;
        if cache.filling.updates > 0 && !cache.is_caught_up() {
            return Some(Batch::CatchUp);
        }
        let pixels = self.pixels() * f64::from(pictures);
        let filled = Filled {
            updates: cache.filling.updates,
            took: cache.filling.took,
            is_good: self.is_filled_for(self.ahead(), stop, pictures),
            share_of_time: self.share_of_time(stop, pictures),
            seconds_per_update: cache.seconds_per_update(),
            paths_per_pixel: cache.paths_in_light() as f64 / pixels,
        };
        next_batch(stop, &filled).map(Batch::Paths)
    }

    /// Takes a few samples through the cache and forgets them, if the time or the error is limited, nodes have gathered, and
    /// it is not known yet, or not well, what samples take. Where the volume streams, few pixels would need as many bricks as
    /// all of them. Returns whether more is known now.
    pub(super) fn try_samples_ahead(&mut self, stop: &Stop, until: Until<'_>) -> Result<bool> {
        let may_be_due = self.updates() >= GATHERED
            && self.totals().samples == 0
            && stop.divides_time()
            && !self.streams();
        if !may_be_due {
            return Ok(false);
        }
        let are_of_all_pixels = match self.samples_ahead {
            None => false,
            Some(SamplesAhead {
                forecast,
                are_of_all_pixels: false,
            }) if self.seconds_filled() >= LITTLE_TIME * self.seconds_to_try(&forecast) => true,
            Some(_) => return Ok(false),
        };
        let tried = if are_of_all_pixels {
            self.try_all_pixels(until)?
        } else {
            let pixels = self.pixels_to_try().min(SHARE_OF_PIXELS * self.pixels());
            self.try_few_pixels(pixels, until)?
        };
        let ahead = tried.map(|forecast| SamplesAhead {
            forecast,
            are_of_all_pixels,
        });
        self.samples_ahead = ahead.or(self.samples_ahead);
        Ok(ahead.is_some())
    }

    /// Time that filling the cache has taken so far.
    pub(super) fn seconds_filled(&self) -> f64 {
        let cache = self.renderer.cache();
        cache.map_or(0.0, |cache| cache.filling.took.as_secs_f64())
    }

    /// The share of the time that filling may take.
    pub(super) fn share_of_time(&self, stop: &Stop, pictures: u32) -> f64 {
        match (stop.time, self.ahead()) {
            (Some(time), Some(ahead)) => ahead.best_share(time.as_secs_f64(), pictures),
            _ => {
                let cache = self.renderer.cache();
                cache_share_of_time(cache.is_some_and(|cache| cache.samples_are_smooth()))
            }
        }
    }

    /// Whether the cache is good enough for pictures of the error that is asked for, which are expected to take what `ahead`
    /// says, or has had its share of their time; where neither is known, whether it has converged.
    pub(super) fn is_filled_for(
        &self,
        ahead: Option<CachedForecast>,
        stop: &Stop,
        pictures: u32,
    ) -> bool {
        let cache = self.renderer.cache();
        let is_known_to = |error| cache.is_some_and(|cache| cache.filling.is_known_to(error));
        match (stop.relative_error, stop.time, ahead) {
            (Some(error), _, Some(ahead)) if ahead.samples.is_known() => {
                ahead.is_filled_for(error, pictures)
            }
            // The better the cache, the better the picture, unless nothing is left to gain.
            (None, Some(time), ahead) if !stop.is_counted() => {
                let (filled, time) = (self.seconds_filled(), time.as_secs_f64());
                let has_had_share =
                    |ahead: CachedForecast| ahead.has_had_its_share(filled, time, pictures);
                is_known_to(0.0) || ahead.is_some_and(has_had_share)
            }
            _ => is_known_to(cache_goal(stop)),
        }
    }

    /// What pictures through the cache are expected to take, if that is known.
    pub(super) fn ahead(&self) -> Option<CachedForecast> {
        Some(CachedForecast {
            samples: self.samples_ahead?.forecast,
            fill: self.filling()?,
        })
    }

    /// What filling the cache is expected to take.
    pub(super) fn filling(&self) -> Option<FillForecast> {
        self.renderer.cache().map(|cache| {
            let filling = &cache.filling;
            let next = filling.updates.max(GATHERED);
            let further = cache.seconds_to(2 * next) - cache.seconds_to(next);
            let per_traced_path = further / f64::from(next);
            let paths = equivalent_paths(filling.updates);
            let traced = (paths - equivalent_paths(GATHERED)).max(0.0);
            let gathering = filling.took.as_secs_f64() + cache.seconds_to(GATHERED);
            let unseen = if filling.updates <= GATHERED {
                UNSEEN_WHILE_GATHERING
            } else {
                1.0
            };
            FillForecast {
                gathering: (gathering - per_traced_path * traced).max(0.0),
                per_traced_path,
                paths,
                variance: unseen * filling.error_at_rest.powi(2) * paths,
            }
        })
    }
}
