//! How far the light in the cache has come for a picture that is shown while it is made: its cache is
//! marched at once, and so need not be as good as one from which samples are taken (`batches.rs`).

use std::time::Duration;

use crate::engine::Engine;
use crate::render::{Batch, next_batch_size};

/// The cache counts as converged at this relative error of the picture that it shows, or after `LONGEST_FILLING` spent
/// on filling it.
pub const SHOWN_CACHE_ERROR: f64 = 0.006;
const LONGEST_FILLING: Duration = Duration::from_secs(30);
/// From this relative error on, the cache's light changes so little that edges are what is seen, and a march has all of its
/// rays.
const EDGES_BELOW: f64 = 2.0 * SHOWN_CACHE_ERROR;

impl Engine {
    /// Number of the cache's batches so far.
    pub(super) fn cache_batches(&self) -> Option<u32> {
        self.cache().map(|cache| cache.work.batches)
    }

    /// The cache's next batch: as many paths as nodes have had, or those that they lack.
    pub(super) fn next_shown_batch(&self) -> Batch {
        let cache = self.cache();
        match cache.map_or(0, |cache| cache.filling.updates) {
            0 => Batch::Paths(1),
            _ if self.cache_is_good() => Batch::CatchUp,
            updates => Batch::Paths(next_batch_size(updates)),
        }
    }

    /// Whether the cache is good enough in the view for which its error was last measured.
    pub(super) fn cache_is_good(&self) -> bool {
        let cache = self.cache();
        cache.is_none_or(|cache| {
            cache.filling.is_known_to(SHOWN_CACHE_ERROR) || cache.filling.took >= LONGEST_FILLING
        })
    }

    /// Whether the cache has converged in this view.
    pub(super) fn cache_is_converged(&self) -> bool {
        self.cache_is_good() && self.is_caught_up()
    }

    /// Whether more rays of each pixel make the picture better than more paths for the cache.
    pub(super) fn shows_edges(&self) -> bool {
        let cache = self.cache();
        self.cache_is_converged() || cache.is_some_and(|c| c.filling.is_known_to(EDGES_BELOW))
    }
}
