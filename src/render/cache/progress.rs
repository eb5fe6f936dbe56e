//! How far a cache has come, and how long more paths will take.

use super::Cache;
use super::pace::{Pace, batch_gathers, next_batch_size};
use crate::render::shared::GATHERED;

impl Cache {
    /// Paths that all nodes have had, on average.
    pub fn mean_updates(&self) -> f64 {
        self.focus.mean_paths()
    }

    /// Paths that all nodes together have had since the light was last forgotten, approximately.
    pub fn paths_in_light(&self) -> u64 {
        self.focus.paths()
    }

    /// Whether the picture that the cache shows is known to within this relative error.
    pub fn is_known_to(&self, error: f64) -> bool {
        self.updates > GATHERED && self.relative_error <= error
    }

    /// Seconds in which the nodes in sight will have had so many paths, as far as one can tell.
    pub fn seconds_to(&self, updates: u32) -> f64 {
        let gathered = self.focus.paths_in_batches_to(updates.min(GATHERED));
        let traced = self.focus.paths_in_batches_to(updates) - gathered;
        self.pace_of_gathering().seconds_per_path() * gathered as f64
            + self.tracing.seconds_per_path() * traced as f64
    }

    /// Seconds that an update of the next batch will take, estimated from the batches so far.
    pub fn seconds_per_update(&self) -> f64 {
        let samples = next_batch_size(self.updates);
        let gathers = batch_gathers(self.updates, samples);
        let expected = if gathers {
            self.pace_of_gathering()
        } else {
            &self.tracing
        };
        let paths = self.focus.paths_to(self.updates + samples);
        expected.seconds_per_path() * paths as f64 / f64::from(samples)
    }

    /// The pace of batches in which nodes gather; that of the others as long as there was none.
    fn pace_of_gathering(&self) -> &Pace {
        if self.gathering.is_known() {
            &self.gathering
        } else {
            &self.tracing
        }
    }

    /// Whether it is known what is in sight, and no node lacks a path.
    pub fn is_caught_up(&self) -> bool {
        let is_filled = self.updates > 0 && self.under_way.is_none();
        is_filled && self.view.is_weighed && !self.focus.lags(self.updates)
    }
}
