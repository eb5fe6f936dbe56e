//! How many paths the cache gets next, and when it has had enough.

use std::time::Duration;

use super::stop::Stop;
use crate::render::next_batch_size;

/// The cache's share of the error asked for, while it is not known how noisy samples are (`filling.rs`): all samples
/// share it, so averaging them does not reduce it.
///
/// Errors add up as squares. A cache with half of the error that is asked for leaves √(1 − ¼) of it to the samples, so that
/// 4/3 as many are needed as beside a perfect cache. A cache with a quarter of the error would need 16/15 as many samples, but
/// four times as many paths.
const CACHE_SHARE_OF_ERROR: f64 = 0.5;
/// Relative error at which the cache counts as converged where no error is asked for.
const CACHE_ERROR: f64 = 0.002;

/// The relative error at which the cache counts as converged.
pub fn cache_goal(stop: &Stop) -> f64 {
    stop.relative_error
        .map_or(CACHE_ERROR, |goal| CACHE_SHARE_OF_ERROR * goal)
}

/// The cache's share of the time, at most, while it is not known how noisy samples are (`filling.rs`); a larger one
/// where they have next to no noise.
pub fn cache_share_of_time(samples_are_smooth: bool) -> f64 {
    if samples_are_smooth { 0.9 } else { 0.5 }
}

/// How far a cache has come.
#[derive(Debug, Clone, Copy)]
pub struct Filled {
    pub updates: u32,
    pub took: Duration,
    /// What it shows is good enough for the error that `stop` asks for, or as good as a cache need be.
    pub is_good: bool,
    /// The share of the time that filling may take.
    pub share_of_time: f64,
    pub seconds_per_update: f64,
    /// Paths of all nodes, for each pixel of all pictures to be made.
    pub paths_per_pixel: f64,
}

/// The fewest paths a node from which the cache's error can be told, and how fast it fills.
pub(super) const FEWEST_UPDATES: u32 = 8;

/// Paths for each node in the next batch; `None` once the picture needs samples more than the cache needs
/// paths. Where samples are counted, the cache gets about as many paths as the pictures get samples.
pub fn next_batch(stop: &Stop, filled: &Filled) -> Option<u32> {
    let enough =
        |spp: u32| filled.updates >= FEWEST_UPDATES && filled.paths_per_pixel >= f64::from(spp);
    if filled.is_good || stop.count().is_some_and(enough) {
        return None;
    }
    let double = next_batch_size(filled.updates);
    let Some(time) = stop.time.filter(|_| filled.updates > 0) else {
        return Some(double);
    };
    let left = time
        .mul_f64(filled.share_of_time)
        .saturating_sub(filled.took);
    let samples = (left.as_secs_f64() / filled.seconds_per_update) as u32;
    // The first batches tell how fast the next ones are.
    let is_early = filled.updates < FEWEST_UPDATES && !left.is_zero();
    if is_early || samples >= double {
        Some(double)
    } else {
        // A batch that is small beside what is there changes nothing that can be seen.
        (8 * samples >= filled.updates).then_some(samples)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::num::NonZeroU32;

    fn filled(updates: u32, seconds: f64, paths_per_pixel: f64) -> Filled {
        Filled {
            updates,
            took: Duration::from_secs_f64(seconds),
            is_good: false,
            share_of_time: 0.5,
            seconds_per_update: seconds / f64::from(updates),
            paths_per_pixel,
        }
    }

    #[test]
    fn a_cache_takes_its_share_of_the_time_and_no_more() {
        let stop = Stop::after(Duration::from_secs(10));
        let filled = |updates, seconds| filled(updates, seconds, 0.0);
        assert_eq!(next_batch(&stop, &filled(0, 0.0)), Some(4));
        assert_eq!(next_batch(&stop, &filled(16, 1.0)), Some(16));
        assert_eq!(next_batch(&stop, &filled(64, 4.0)), Some(16));
        assert_eq!(next_batch(&stop, &filled(64, 4.9)), None);
        assert_eq!(
            next_batch(&stop, &filled(30, 3.0)),
            Some(2),
            "to where gathering ends"
        );
        assert_eq!(next_batch(&stop, &filled(1, 20.0)), None);
    }

    #[test]
    fn a_cache_takes_as_many_paths_as_pictures_take_samples() {
        let stop = Stop::at_samples(NonZeroU32::MIN.saturating_add(63));
        let filled = |updates, paths_per_pixel| filled(updates, 0.0, paths_per_pixel);
        assert_eq!(next_batch(&stop, &filled(8, 60.0)), Some(8));
        assert_eq!(next_batch(&stop, &filled(16, 64.0)), None);
        assert_eq!(
            next_batch(&stop, &filled(2, 64.0)),
            Some(2),
            "too few to tell an error"
        );
    }
}
