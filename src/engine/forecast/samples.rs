//! What samples of a picture take, and how their number lowers its error.

use super::super::schedule::MOST_AT_ONCE;
use super::super::stop::UNITS_TO_TRUST;
use super::super::task::Task;

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

impl SampleForecast {
    /// Whether samples that were tried have met light; otherwise nothing is known of their noise.
    pub fn is_known(&self) -> bool {
        self.variance.is_finite()
    }

    /// Square of the relative error that is reported after so many samples; infinite below one, which makes no picture.
    /// Samples come in units of a sixteenth of their number, and the reported error accounts for their even spread only
    /// within a unit.
    pub fn variance_after(&self, samples: f64) -> f64 {
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
    pub fn samples_in(&self, seconds: f64) -> f64 {
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

    pub fn seconds_to(&self, error: f64, pictures: u32) -> f64 {
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

#[cfg(test)]
mod tests {
    use super::super::examples::UNCACHED;
    use super::*;

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
}
