//! How far the filling of a cache has come, and how long more paths will take.

use std::time::Duration;

use serde::{Deserialize, Serialize};

use super::Cache;
use super::pace::{Pace, batch_gathers, next_batch_size};
use crate::render::shared::GATHERED;

/// The filling since the light was last forgotten.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Filling {
    /// Paths that the nodes in sight have had.
    pub updates: u32,
    /// Relative error of the picture that the cache shows: rms(standard error)/mean. Infinite until there are two
    /// batches.
    #[serde(with = "null_if_infinite")]
    pub relative_error: f64,
    /// The same of what a picture at rest takes from the cache.
    #[serde(with = "null_if_infinite")]
    pub error_at_rest: f64,
    /// Time that filling has taken.
    pub took: Duration,
    /// The pace of batches in which nodes gather (`gathering.glsl`).
    pub(super) gathering: Pace,
    /// The pace of batches of traced paths.
    pub(super) tracing: Pace,
}

/// The work in all batches, whether or not their light has been forgotten.
#[derive(Debug, Clone, Copy, Default, PartialEq, Serialize, Deserialize)]
pub struct FillingWork {
    /// Batches that have ended.
    pub batches: u32,
    /// Paths traced.
    pub paths: u64,
    /// Reads of the volume by them.
    pub lookups: u64,
}

impl Filling {
    /// Of a cache without light.
    pub const NONE: Filling = Filling {
        updates: 0,
        relative_error: f64::INFINITY,
        error_at_rest: f64::INFINITY,
        took: Duration::ZERO,
        gathering: Pace::NONE,
        tracing: Pace::NONE,
    };

    /// Whether the picture that the cache shows is known to within this relative error.
    pub fn is_known_to(&self, error: f64) -> bool {
        self.updates > GATHERED && self.relative_error <= error
    }

    /// The pace of batches in which nodes gather; that of the others as long as there was none.
    fn pace_of_gathering(&self) -> &Pace {
        if self.gathering.is_known() {
            &self.gathering
        } else {
            &self.tracing
        }
    }
}

impl Cache {
    /// Paths that all nodes have had, on average.
    pub fn mean_updates(&self) -> f64 {
        self.sight.focus.mean_paths()
    }

    /// Paths that all nodes together have had since the light was last forgotten, approximately.
    pub fn paths_in_light(&self) -> u64 {
        self.sight.focus.paths()
    }

    /// Seconds in which the nodes in sight will have had so many paths, as far as one can tell.
    pub fn seconds_to(&self, updates: u32) -> f64 {
        let gathered = self.sight.focus.paths_in_batches_to(updates.min(GATHERED));
        let traced = self.sight.focus.paths_in_batches_to(updates) - gathered;
        self.filling.pace_of_gathering().seconds_per_path() * gathered as f64
            + self.filling.tracing.seconds_per_path() * traced as f64
    }

    /// Seconds that an update of the next batch will take, estimated from the batches so far.
    pub fn seconds_per_update(&self) -> f64 {
        let updates = self.filling.updates;
        let batch = next_batch_size(updates);
        let expected = if batch_gathers(updates, batch) {
            self.filling.pace_of_gathering()
        } else {
            &self.filling.tracing
        };
        let paths = self.sight.focus.paths_to(updates + batch);
        expected.seconds_per_path() * paths as f64 / f64::from(batch)
    }

    /// Seconds that the next batch is expected to take.
    pub fn seconds_of_next_batch(&self) -> f64 {
        self.seconds_per_update() * f64::from(next_batch_size(self.filling.updates))
    }

    /// Whether there is light, the bricks of this view have been weighed, no batch is under way, and every node has had the
    /// paths that its brick's share requires.
    pub fn is_caught_up(&self) -> bool {
        let is_filled = self.filling.updates > 0 && self.under_way.is_none();
        is_filled && self.sight.view.is_weighed && !self.sight.focus.lags(self.filling.updates)
    }
}

/// Numbers in JSON, which has no infinity.
mod null_if_infinite {
    use serde::{Deserialize, Deserializer, Serialize, Serializer};

    pub fn serialize<S: Serializer>(number: &f64, to: S) -> Result<S::Ok, S::Error> {
        Some(*number).filter(|n| n.is_finite()).serialize(to)
    }

    pub fn deserialize<'de, D: Deserializer<'de>>(from: D) -> Result<f64, D::Error> {
        Ok(Option::deserialize(from)?.unwrap_or(f64::INFINITY))
    }
}
