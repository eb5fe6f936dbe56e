//! How far a cache is filled before samples are taken.
//!
//! The cache's error is the same in all samples, while the noise of samples falls with their number. So the time is divided
//! between filling and sampling by what each gains from it (`forecast.rs`). Gathering takes little time and is always worth
//! it. Before nodes trace whole paths, a trial with few pixels measures the noise and the time of samples.

use super::Engine;
use super::batches::{cache_goal, cache_share_of_time};
use super::forecast::{FillForecast, Forecast};
use super::schedule::Stop;
use crate::error::Result;
use crate::render::shared::GATHERED;
use crate::render::{Cache, Until, equivalent_paths};

/// Nodes that gather share the errors of the light that they read, which the change from batch to batch does not show.
/// Until nodes trace whole paths, the measured variance of the cache is multiplied by this.
const UNSEEN_WHILE_GATHERING: f64 = 5.0;
/// The samples that are tried have this share of the picture's pixels, at most.
const SHARE_OF_PIXELS: f64 = 0.125;

impl Engine {
    /// Paths that the nodes in sight have had; 0 without a cache.
    pub(super) fn updates(&self) -> u32 {
        let cache = self.renderer.cache();
        cache.map_or(0, |cache| cache.filling.updates)
    }

    /// Takes a few samples through the cache and forgets them, if the time or the error is limited, nodes have gathered, and
    /// it is not known yet what samples take. Where the volume streams, few pixels would need as many bricks as all of them.
    /// Returns whether more is known now.
    pub(super) fn try_samples_ahead(&mut self, stop: &Stop, until: Until<'_>) -> Result<bool> {
        let is_due = self.updates() >= GATHERED
            && self.samples_ahead.is_none()
            && self.totals().samples == 0
            && (stop.time.is_some() || stop.relative_error.is_some())
            && stop.count().is_none()
            && !self.streams();
        if is_due {
            let pixels = self.pixels_to_try().min(SHARE_OF_PIXELS * self.pixels());
            self.samples_ahead = self.try_few_pixels(pixels, until)?;
        }
        Ok(is_due && self.samples_ahead.is_some())
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
    /// says; where either is missing, whether it has converged.
    pub(super) fn is_filled_for(
        &self,
        ahead: Option<Forecast>,
        stop: &Stop,
        pictures: u32,
    ) -> bool {
        let is_converged = |cache: &Cache| cache.filling.is_known_to(cache_goal(stop));
        match (stop.relative_error, ahead) {
            (Some(error), Some(ahead)) => ahead.is_filled_for(error, pictures),
            _ => self.renderer.cache().is_some_and(is_converged),
        }
    }

    /// What pictures through the cache are expected to take, if that is known.
    pub(super) fn ahead(&self) -> Option<Forecast> {
        self.samples_ahead.map(|samples| Forecast {
            cache: self.filling(),
            ..samples
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
