//! The arithmetic of a trial: how long a variant takes until pictures are good, or how good they are when time is over.
//! Noise falls with the root of the number of samples, and the error of a cache with that of its equivalent paths.

mod cached;
mod samples;

pub use cached::{CachedForecast, FillForecast};
pub use samples::{SampleForecast, VarianceReduction, variance_ratio};

/// What a variant is expected to take for its pictures.
#[derive(Debug, Clone, Copy)]
pub enum Forecast {
    Uncached(SampleForecast),
    Cached(CachedForecast),
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
