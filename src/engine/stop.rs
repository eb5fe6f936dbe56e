//! When a render stops, by how far it has come.

use std::fmt;
use std::num::NonZeroU32;
use std::time::Duration;

use super::sample_range::SampleRange;
use crate::error::figure;
use crate::render::Halves;

/// When to stop: at whichever of these comes first.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Stop {
    /// Samples of every pixel.
    pub samples: Option<Samples>,
    /// Wall time of rendering, without loading and compiling. A first sample may take longer.
    pub time: Option<Duration>,
    /// rms(standard error) / mean(RGB) of the picture.
    pub relative_error: Option<f64>,
}

/// Samples of every pixel.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Samples {
    /// So many of them, from the first on.
    Count(NonZeroU32),
    /// Exactly these: a shard of a picture.
    Shard(SampleRange),
}

impl Stop {
    /// By time alone.
    pub fn after(time: Duration) -> Stop {
        Stop {
            time: Some(time),
            ..Stop::default()
        }
    }

    /// By a number of samples alone.
    pub fn at_samples(spp: NonZeroU32) -> Stop {
        Stop {
            samples: Some(Samples::Count(spp)),
            ..Stop::default()
        }
    }

    /// Samples per pixel, if they are counted.
    pub fn count(&self) -> Option<u32> {
        self.samples.map(|samples| match samples {
            Samples::Count(spp) => spp.get(),
            Samples::Shard(range) => range.count(),
        })
    }

    /// The shard of a picture that is asked for; `None`: samples from the first on.
    pub fn shard(&self) -> Option<SampleRange> {
        match self.samples {
            Some(Samples::Shard(range)) => Some(range),
            Some(Samples::Count(_)) | None => None,
        }
    }

    /// Index of the first sample in the whole picture.
    pub fn first_sample(&self) -> u32 {
        self.shard().map_or(0, |range| range.first)
    }

    /// Whether samples are counted. What is rendered does not depend on the time then: the same command gives the same bits.
    pub(super) fn is_counted(&self) -> bool {
        self.count().is_some()
    }

    /// Whether time or error alone end it: it pays then to divide the time between filling a cache and sampling.
    pub(super) fn divides_time(&self) -> bool {
        !self.is_counted() && (self.time.is_some() || self.relative_error.is_some())
    }

    /// Seconds of rendering; infinite where they are not limited.
    pub(super) fn seconds(&self) -> f64 {
        self.time.map_or(f64::INFINITY, |time| time.as_secs_f64())
    }

    /// The time after which a cache's first paths or a picture's first sample are too late.
    pub(super) fn late(&self) -> Option<Duration> {
        self.time.map(with_delay)
    }

    /// Why to stop now; `None`: go on.
    pub fn reason(&self, so_far: &Sampled) -> Option<StopReason> {
        if let Some(goal) = self.count()
            && so_far.samples >= goal
        {
            let of_shard = self.shard().map(StopReason::Shard);
            return Some(of_shard.unwrap_or(StopReason::Spp(goal)));
        }
        if let Some(goal) = self.relative_error
            && self.may_end_by_error(so_far.units)
            && so_far.relative_error <= goal
        {
            return Some(StopReason::RelativeError(goal));
        }
        if so_far.first_sample + so_far.samples >= SampleRange::MOST {
            return Some(StopReason::MostSamples);
        }
        if let Some(goal) = self.time
            && so_far.units > 0
            && so_far.took >= goal
        {
            return Some(StopReason::Time(goal));
        }
        None
    }

    /// Whether the error of so many units may end a picture.
    pub(super) fn may_end_by_error(&self, units: u32) -> bool {
        self.relative_error.is_some() && units >= UNITS_TO_TRUST
    }

    /// Seconds until it is reached, estimated from the progress so far.
    pub fn seconds_left(&self, so_far: &Sampled) -> Option<f64> {
        let samples = f64::from(so_far.samples);
        let until = |goal: f64| (goal - samples) * so_far.seconds_per_sample;
        let by_count = self.count().map(|goal| until(f64::from(goal)));
        let took = so_far.took.as_secs_f64();
        let by_time = self.time.map(|goal| goal.as_secs_f64() - took);
        // The error falls as 1/√n.
        let by_error = self
            .relative_error
            .map(|goal| until(samples * (so_far.relative_error / goal).powi(2)));
        [by_count, by_time, by_error]
            .into_iter()
            .flatten()
            .filter(|seconds| seconds.is_finite())
            .reduce(f64::min)
            .map(|seconds| seconds.max(0.0))
    }
}

/// As the end of the sentence "it ends after …".
impl fmt::Display for Stop {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let samples = self.samples.map(|samples| match samples {
            Samples::Count(spp) => format!("{spp} samples"),
            Samples::Shard(range) => format!("samples {range}"),
        });
        let time = self.time.map(|time| format!("{} s", time.as_secs_f64()));
        let error = self.relative_error;
        let error = error.map(|error| format!("a relative error of {}", figure(error)));
        let all: Vec<String> = [samples, time, error].into_iter().flatten().collect();
        f.write_str(&all.join(" or "))
    }
}

/// How far a picture has come.
#[derive(Debug, Clone, Copy)]
pub struct Sampled {
    /// Index of the first sample in the whole picture.
    pub first_sample: u32,
    /// Samples of each pixel so far.
    pub samples: u32,
    /// Units so far.
    pub units: u32,
    /// Time spent on the picture, with the filling of the cache where that is the picture's.
    pub took: Duration,
    /// Seconds that a sample of every pixel takes; infinite while it is unknown, so that a single one is taken next.
    pub seconds_per_sample: f64,
    /// Not finite while it is unknown.
    pub relative_error: f64,
}

/// Before this many units the spread between them says too little to stop by. Marched samples are units of their own, and
/// how evenly they are spread is looked at from this number on.
pub const UNITS_TO_TRUST: u32 = Halves::LEAST;

/// Why a render has stopped. Displayed, it is the end of the sentence "stopped because …".
#[derive(Debug, Clone, PartialEq)]
pub enum StopReason {
    /// As many samples per pixel as were asked for.
    Spp(u32),
    /// All samples of the shard.
    Shard(SampleRange),
    /// No picture has more samples.
    MostSamples,
    /// The relative error is below this.
    RelativeError(f64),
    Time(Duration),
    /// The run's interruption.
    Interrupted,
}

impl fmt::Display for StopReason {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            StopReason::Spp(count) => write!(f, "it has {count} samples per pixel"),
            StopReason::Shard(range) => write!(f, "samples {range} are done"),
            StopReason::MostSamples => {
                let most = SampleRange::MOST;
                write!(f, "a picture has {most} samples per pixel at most")
            }
            StopReason::RelativeError(goal) => {
                write!(f, "the relative error is below {}", figure(*goal))
            }
            StopReason::Time(time) => {
                write!(f, "{} s of rendering are over", time.as_secs_f64())
            }
            StopReason::Interrupted => write!(f, "it was interrupted"),
        }
    }
}

/// The time after which a cache's first paths or a picture's first sample are too late, if `time` is what was given: a
/// picture a little late is better than none.
pub(super) fn with_delay(time: Duration) -> Duration {
    const LEAST_DELAY: Duration = Duration::from_secs(5);
    time.saturating_add(time.max(LEAST_DELAY))
}

#[cfg(test)]
pub(super) mod examples {
    use super::*;

    pub fn stop(spp: Option<u32>, seconds: Option<u64>, relative_error: Option<f64>) -> Stop {
        Stop {
            samples: spp.and_then(NonZeroU32::new).map(Samples::Count),
            time: seconds.map(Duration::from_secs),
            relative_error,
        }
    }

    pub fn sampled(samples: u32, units: u32, seconds: f64, relative_error: f64) -> Sampled {
        Sampled {
            first_sample: 0,
            samples,
            units,
            took: Duration::from_secs_f64(seconds),
            seconds_per_sample: seconds / f64::from(samples.max(1)),
            relative_error,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::examples::{sampled, stop};
    use super::*;

    #[test]
    fn a_reason_states_its_number_as_one_would_type_it() {
        for (goal, number) in [(0.02, "0.02"), (1e300, "1e300")] {
            let said = StopReason::RelativeError(goal).to_string();
            assert_eq!(said, format!("the relative error is below {number}"));
        }
    }

    #[test]
    fn the_error_counts_only_once_it_can_be_trusted() {
        let stop = stop(None, None, Some(0.1));
        assert!(stop.reason(&sampled(15, 15, 1.0, 0.01)).is_none());
        assert!(stop.reason(&sampled(16, 16, 1.0, 0.01)).is_some());
        assert!(stop.reason(&sampled(16, 16, 1.0, f64::NAN)).is_none());
    }
}
