//! The arithmetic of a trial: how long a variant takes until pictures are good, or how good they are when time is over.
//! Noise falls with the root of the number of samples, and the error of a cache with that of its equivalent paths.

use super::schedule::MOST_AT_ONCE;
use super::stop::UNITS_TO_TRUST;
use super::task::Task;
use crate::render::equivalent_paths;
use crate::render::shared::GATHERED;

/// How often a cache's paths are doubled at most, in a comparison of how far to fill it.
const DOUBLINGS: u32 = 24;
/// A cache is filled further only if the work would otherwise take more than so many times as long: forecasts are not more
/// exact than that.
const WORTH_FILLING: f64 = 1.2;
/// Shares of the time that are compared are multiples of one part in so many.
const SHARES: u32 = 40;

/// What a variant is expected to take for its pictures.
#[derive(Debug, Clone, Copy)]
pub enum Forecast {
    Uncached(SampleForecast),
    Cached(CachedForecast),
}

/// What samples of a picture are expected to take, apart from any filling.
#[derive(Debug, Clone, Copy)]
pub struct SampleForecast {
    /// Seconds that a sample of every pixel takes.
    pub seconds_per_sample: f64,
    /// Seconds that bringing bricks takes for units that are done together; 0 where the volume is whole.
    pub seconds_per_bundle: f64,
    /// Square of the relative error after one sample.
    pub variance: f64,
    pub reduction: VarianceReduction,
}

/// What a cache and samples through it are expected to take.
#[derive(Debug, Clone, Copy)]
pub struct CachedForecast {
    pub samples: SampleForecast,
    pub fill: FillForecast,
}

/// How much smaller the variance of a mean of low-discrepancy samples is than that of independent ones.
#[derive(Debug, Clone, Copy)]
pub struct VarianceReduction {
    /// The number of samples for which `ratio` is known.
    pub samples: u32,
    /// The variance of the mean of so many samples, as a share of that of as many independent ones.
    pub ratio: f64,
}

impl VarianceReduction {
    /// Samples that are independent, or not known to be better.
    pub const NONE: VarianceReduction = VarianceReduction {
        samples: 1,
        ratio: 1.0,
    };
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

impl Forecast {
    /// Seconds until all pictures have this relative error.
    pub fn seconds_to(&self, error: f64, pictures: u32) -> f64 {
        match self {
            Forecast::Uncached(samples) => samples.seconds_to(error, pictures),
            Forecast::Cached(cached) => cached.seconds_to(error, pictures),
        }
    }

    /// The relative error of pictures that take so many seconds each.
    pub fn error_after(&self, seconds: f64, pictures: u32) -> f64 {
        match self {
            Forecast::Uncached(samples) => {
                samples.variance_after(samples.samples_in(seconds)).sqrt()
            }
            Forecast::Cached(cached) => cached.error_after(seconds, pictures),
        }
    }
}

impl SampleForecast {
    /// Whether samples that were tried have met light; otherwise nothing is known of their noise.
    pub fn is_known(&self) -> bool {
        self.variance.is_finite()
    }

    /// Square of the relative error that is reported after so many samples; infinite below one, which makes no picture.
    /// Samples come in units of a sixteenth of their number, and the reported error accounts for their even spread only
    /// within a unit.
    fn variance_after(&self, samples: f64) -> f64 {
        if samples < 1.0 {
            return f64::INFINITY;
        }
        let known = f64::from(self.reduction.samples).log2();
        let unit = (samples / 16.0).max(1.0).log2().min(known);
        self.variance * self.reduction.ratio.powf(unit / known.max(1.0)) / samples
    }

    /// Samples after which a relative error is reported.
    fn samples_to(&self, error: f64) -> f64 {
        let mut samples = f64::from(UNITS_TO_TRUST);
        while samples.is_finite() && self.variance_after(samples) > error.powi(2) {
            samples *= 1.05;
        }
        samples
    }

    /// Seconds that so many samples of a picture take.
    fn seconds_for(&self, samples: f64) -> f64 {
        samples * self.seconds_per_sample + bundles(samples) * self.seconds_per_bundle
    }

    /// The number of samples of a picture for which there is time in so many seconds, by bisection.
    fn samples_in(&self, seconds: f64) -> f64 {
        let (mut low, mut high) = (0.0, seconds / self.seconds_per_sample);
        if self.seconds_per_bundle == 0.0 {
            return high;
        }
        for _ in 0..f64::MANTISSA_DIGITS {
            let middle = (low + high) / 2.0;
            if self.seconds_for(middle) <= seconds {
                low = middle;
            } else {
                high = middle;
            }
        }
        low
    }

    fn seconds_to(&self, error: f64, pictures: u32) -> f64 {
        let samples = self.samples_to(error);
        if samples.is_finite() {
            f64::from(pictures) * self.seconds_for(samples)
        } else {
            f64::INFINITY
        }
    }

    /// Seconds until the task is done without filling anything or its time is over.
    pub fn seconds_of(&self, task: &Task<'_>) -> f64 {
        let to_error = task
            .stop
            .relative_error
            .map(|error| self.seconds_to(error, task.pictures));
        to_error.unwrap_or(f64::INFINITY).min(task.seconds())
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

/// How many times units are begun together until there are so many samples (`units_together` in `schedule.rs`).
fn bundles(samples: f64) -> f64 {
    1.0 + samples.max(1.0).ln() / f64::from(1 + MOST_AT_ONCE).ln()
}

/// The variance of the mean of n samples as a share of that of independent ones, estimated: `independent` is the variance
/// that a mean of n independent samples would have, and `change` is by how much the mean changes once n more have followed.
///
/// The mean moves by half the difference of two means of n samples. The square of that is on average half the variance of
/// one of them.
pub fn variance_ratio(independent: f64, change: f64) -> f64 {
    const LEAST: f64 = 0.05;
    if independent > 0.0 {
        (2.0 * change.powi(2) / independent).clamp(LEAST, 1.0)
    } else {
        1.0
    }
}

/// Forecasts for tests.
#[cfg(test)]
pub(super) mod examples {
    use super::*;

    pub const UNCACHED: SampleForecast = SampleForecast {
        seconds_per_sample: 0.1,
        seconds_per_bundle: 0.0,
        variance: 1.0,
        reduction: VarianceReduction::NONE,
    };
    pub const CACHED: CachedForecast = CachedForecast {
        samples: SampleForecast {
            variance: 0.04,
            ..UNCACHED
        },
        fill: FillForecast {
            gathering: 1.0,
            per_traced_path: 0.1,
            paths: 4.0,
            variance: 1e-4,
        },
    };
}

#[cfg(test)]
mod tests {
    use super::examples::{CACHED, UNCACHED};
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

    #[test]
    fn what_is_unknown_is_not_expected_at_any_time() {
        let unknown = SampleForecast {
            variance: f64::INFINITY,
            ..UNCACHED
        };
        assert_eq!(unknown.seconds_to(0.02, 1), f64::INFINITY);
        assert_eq!(unknown.variance_after(1e6), f64::INFINITY);
    }

    #[test]
    fn even_samples_are_known_by_how_little_more_of_them_change() {
        for ratio in [0.2, 1.0] {
            let independent: f64 = 0.01;
            let difference = (2.0 * ratio * independent).sqrt();
            assert!((variance_ratio(independent, 0.5 * difference) - ratio).abs() < 1e-9);
        }
        let even = SampleForecast {
            reduction: VarianceReduction {
                samples: 8,
                ratio: 0.25,
            },
            ..UNCACHED
        };
        assert!((UNCACHED.samples_to(0.05) / 400.0 - 1.0).abs() < 0.1);
        let fewer = even.samples_to(0.05) / UNCACHED.samples_to(0.05);
        assert!((0.25..0.6).contains(&fewer), "{fewer}");
    }

    /// Where the volume streams, what bricks take is paid a few times a picture, not for each sample.
    #[test]
    fn bricks_are_brought_for_all_units_that_are_done_together() {
        let streamed = SampleForecast {
            seconds_per_sample: 0.01,
            seconds_per_bundle: 1.0,
            ..UNCACHED
        };
        assert!((streamed.seconds_for(256.0) - 7.56).abs() < 1e-9);
        for samples in [1.0, 13.0, 256.0, 1e4] {
            let found = streamed.samples_in(streamed.seconds_for(samples));
            assert!((found / samples - 1.0).abs() < 1e-9, "{samples}: {found}");
        }
        assert!(streamed.samples_in(0.5) < 1.0);
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
