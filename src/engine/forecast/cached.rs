//! What filling a cache takes, and how the time is best divided between that and samples through it.

use super::samples::SampleForecast;
use crate::render::equivalent_paths;
use crate::render::shared::GATHERED;

/// How often a cache's paths are doubled at most, in a comparison of how far to fill it.
const DOUBLINGS: u32 = 24;
/// A cache is filled further only if the work would otherwise take more than so many times as long: forecasts are not more
/// exact than that.
const WORTH_FILLING: f64 = 1.2;
/// Shares of the time that are compared are multiples of one part in so many.
const SHARES: u32 = 40;

/// What a cache and samples through it are expected to take.
#[derive(Debug, Clone, Copy)]
pub struct CachedForecast {
    pub samples: SampleForecast,
    pub fill: FillForecast,
}

/// What filling the cache is expected to take. Paths are counted as equivalent ones ([`equivalent_paths`]), since those
/// that are gathered at first take less time and tell less than those that are traced.
#[derive(Debug, Clone, Copy)]
pub struct FillForecast {
    /// The equivalent paths that nodes have had.
    pub paths: f64,
    /// Seconds until nodes have had their first [`GATHERED`] paths.
    pub gathering: f64,
    /// Seconds for each further path of all nodes.
    pub per_traced_path: f64,
    /// Square of the relative error of what the cache shows after one equivalent path.
    pub variance: f64,
}

impl FillForecast {
    /// Seconds until nodes have had so many equivalent paths.
    fn seconds_to(&self, paths: f64) -> f64 {
        let gathered = equivalent_paths(GATHERED);
        self.gathering * paths.min(gathered) / gathered
            + self.per_traced_path * (paths - gathered).max(0.0)
    }

    /// The equivalent paths that nodes have had after so many seconds.
    fn paths_after(&self, seconds: f64) -> f64 {
        let gathered = equivalent_paths(GATHERED);
        if seconds < self.gathering {
            gathered * seconds / self.gathering
        } else {
            gathered + (seconds - self.gathering) / self.per_traced_path
        }
    }
}

impl CachedForecast {
    pub fn seconds_to(&self, error: f64, pictures: u32) -> f64 {
        // Filling ends with a batch, which doubles what there is.
        let paths = self.fill.paths.max(equivalent_paths(GATHERED));
        let fills = (0..DOUBLINGS).map(|n| paths * f64::from(n).exp2());
        fills
            .map(|paths| self.seconds_with(paths, error, pictures))
            .fold(f64::INFINITY, f64::min)
    }

    /// Seconds until all pictures have this relative error, if the cache is filled with so many equivalent paths; infinite
    /// if that is too little.
    fn seconds_with(&self, paths: f64, error: f64, pictures: u32) -> f64 {
        let CachedForecast { samples, fill } = self;
        let left = error.powi(2) - fill.variance / paths;
        if left > 0.0 {
            fill.seconds_to(paths) + samples.seconds_to(left.sqrt(), pictures)
        } else {
            f64::INFINITY
        }
    }

    /// Whether pictures have a relative error soonest, or hardly later, if the cache is filled no further.
    pub fn is_filled_for(&self, error: f64, pictures: u32) -> bool {
        let seconds = self.seconds_with(self.fill.paths, error, pictures);
        seconds.is_finite() && seconds <= WORTH_FILLING * self.seconds_to(error, pictures)
    }

    pub fn error_after(&self, seconds: f64, pictures: u32) -> f64 {
        let share = self.best_share(seconds, pictures);
        self.variance_with(share, seconds, pictures).sqrt()
    }

    /// The share of the first picture's seconds that filling should take for the least error of all pictures, which take so
    /// many each.
    pub fn best_share(&self, seconds: f64, pictures: u32) -> f64 {
        let variance = |share: &f64| self.variance_with(*share, seconds, pictures);
        let shares = (1..SHARES).map(|n| f64::from(n) / f64::from(SHARES));
        let best = shares.min_by(|a, b| variance(a).total_cmp(&variance(b)));
        best.unwrap_or_default()
    }

    /// Whether filling, which has taken so many seconds, has had its share of the first picture's.
    pub fn has_had_its_share(&self, filled: f64, seconds: f64, pictures: u32) -> bool {
        filled >= seconds * self.best_share(seconds, pictures)
    }

    /// Mean square of the pictures' relative errors, if filling takes this share of the first one's seconds.
    fn variance_with(&self, share: f64, seconds: f64, pictures: u32) -> f64 {
        let CachedForecast { samples, fill } = self;
        let filling = share * seconds;
        let cached = fill.variance / fill.paths_after(filling);
        let [first, other] = [seconds - filling, seconds]
            .map(|left| samples.variance_after(samples.samples_in(left)));
        cached + other + (first - other) / f64::from(pictures)
    }
}

#[cfg(test)]
mod tests {
    use super::super::examples::CACHED;
    use super::*;

    /// Of two variances that fall as a/s and b/(1 − s), the sum is least at s = √a/(√a + √b). Only the first of several
    /// pictures pays.
    #[test]
    fn time_goes_to_what_it_makes_better() {
        let share = |variance: f64| {
            let fill = FillForecast {
                paths: 0.0,
                gathering: 0.0,
                per_traced_path: 0.1,
                variance,
            };
            let forecast = CachedForecast { fill, ..CACHED };
            [1, 4].map(|pictures| forecast.best_share(1e4, pictures))
        };
        let expected = |ratio: f64| ratio.sqrt() / (1.0 + ratio.sqrt());
        for ratio in [0.01, 0.25, 1.0, 9.0] {
            let found = share(ratio * CACHED.samples.variance);
            let expected = [expected(ratio), expected(4.0 * ratio)];
            for (found, expected) in found.into_iter().zip(expected) {
                assert!((found - expected).abs() < 0.02, "{ratio}: {found}");
            }
        }
        assert!(share(0.0)[0] < 0.03);
    }

    /// A cache is not filled to less than the picture needs, nor further where samples are sooner done.
    #[test]
    fn filling_ends_where_samples_gain_more() {
        let after = |paths: f64| CachedForecast {
            fill: FillForecast {
                paths,
                ..CACHED.fill
            },
            ..CACHED
        };
        // The variance of a cache of 4 equivalent paths is 2.5e-5.
        assert!(after(4.0).is_filled_for(0.02, 1));
        assert!(!after(4.0).is_filled_for(0.004, 1));
        assert!(
            !after(4.0).is_filled_for(0.0055, 1),
            "20 times as many samples"
        );
        assert!(after(256.0).is_filled_for(0.0055, 1));
        // Many pictures gain by what is filled once.
        assert!(after(4.0).is_filled_for(0.011, 1));
        assert!(!after(4.0).is_filled_for(0.011, 100));
    }

    /// Where time alone limits a render, no error of the cache is good enough.
    #[test]
    fn a_cache_is_filled_for_its_share_of_the_time() {
        let converged = CachedForecast {
            fill: FillForecast {
                paths: 1024.0,
                ..CACHED.fill
            },
            ..CACHED
        };
        let share = converged.best_share(60.0, 1);
        assert!(!converged.has_had_its_share(0.9 * share * 60.0, 60.0, 1));
        assert!(converged.has_had_its_share(1.1 * share * 60.0, 60.0, 1));
    }

    /// However noisy the cache is, there is time left for a sample.
    #[test]
    fn filling_never_takes_all_the_time() {
        let noisy = CachedForecast {
            samples: SampleForecast {
                seconds_per_sample: 8.0,
                variance: 1e-4,
                ..CACHED.samples
            },
            fill: FillForecast {
                variance: 10.0,
                ..CACHED.fill
            },
        };
        let left = 10.0 * (1.0 - noisy.best_share(10.0, 1));
        assert!((8.0..8.5).contains(&left), "{left}");
    }
}
