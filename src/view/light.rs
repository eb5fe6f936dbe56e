//! How far the light in the cache has come for the window's picture.

use std::time::Duration;

use crate::engine::Engine;
use crate::render::{Batch, next_batch_size};

/// The cache counts as converged at this relative error of the picture that it shows, or after `LONGEST_FILLING` spent
/// on filling it.
pub const CACHE_ERROR: f64 = 0.006;
const LONGEST_FILLING: Duration = Duration::from_secs(30);
/// From this relative error on, the cache's light changes so little that edges are what is seen, and a march has all of its
/// rays.
const EDGES_BELOW: f64 = 2.0 * CACHE_ERROR;

/// Number of the cache's batches so far.
pub fn batches(engine: &Engine) -> Option<u32> {
    engine.cache().map(|cache| cache.work.batches)
}

/// The cache's next batch: as many paths as nodes have had, or those that they lack.
pub fn next_batch(engine: &Engine) -> Batch {
    let cache = engine.cache();
    match cache.map_or(0, |cache| cache.filling.updates) {
        0 => Batch::Paths(1),
        _ if cache_is_good(engine) => Batch::CatchUp,
        updates => Batch::Paths(next_batch_size(updates)),
    }
}

/// Whether the cache is good enough in the view for which its error was last measured.
pub fn cache_is_good(engine: &Engine) -> bool {
    let cache = engine.cache();
    cache.is_none_or(|cache| {
        cache.filling.is_known_to(CACHE_ERROR) || cache.filling.took >= LONGEST_FILLING
    })
}

/// Whether the cache has converged in this view.
pub fn cache_is_converged(engine: &Engine) -> bool {
    let cache = engine.cache();
    cache_is_good(engine) && cache.is_none_or(|cache| cache.is_caught_up())
}

/// Whether more rays of each pixel make the picture better than more paths for the cache.
pub fn shows_edges(engine: &Engine) -> bool {
    let cache = engine.cache();
    cache_is_converged(engine) || cache.is_some_and(|c| c.filling.is_known_to(EDGES_BELOW))
}
