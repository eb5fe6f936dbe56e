//! When to stop, and how many samples to take next.
//!
//! Samples come in units (see `render`). Units grow with what is done, to a sixteenth of it at
//! most: early ones show a picture soon, late ones cost little to begin and to end, at least sixteen of
//! them give a standard error, and a stop never throws away more than a sixteenth of the work. They are
//! powers of two that begin at multiples of themselves, since those are what samples are spread evenly over
//! (glsl/include/random.glsl): the spread between units then shows most of what that gains. They follow from a sample's
//! index in the whole picture, so that shards have the units of a single run. Only a shard that begins so late that it would
//! have fewer than four of them has shorter ones, a sixteenth of it at most, so that it knows its own error.
//!
//! Units are blocks of one sequence, so their spread is that of independently scrambled batches only in so far as the blocks
//! are independent of each other: without a cache, what is reported is 1.01 to 1.07 times the true error ("The error that is
//! reported" in tools/measurements/cache.md).
//!
//! In a march each sample is a unit of its own to the renderer, and units here are only what is taken between two looks
//! (`render/units.rs`, `render/halves.rs`).

use std::num::NonZeroU32;
use std::time::Duration;

use super::sample_range::SampleRange;
use crate::error::figure;
use crate::render::Halves;

/// When to stop: at whichever of these comes first.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Stop {
    /// Samples per pixel.
    pub spp: Option<NonZeroU32>,
    /// Exactly these samples of every pixel: a shard of a picture.
    pub samples: Option<SampleRange>,
    /// Time spent on rendering.
    pub time: Option<Duration>,
    /// rms(standard error) / mean(RGB) of the picture.
    pub relative_error: Option<f64>,
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
            spp: Some(spp),
            ..Stop::default()
        }
    }

    /// Samples per pixel, if they are counted.
    pub fn count(&self) -> Option<u32> {
        let range = self.samples.map(|range| range.count());
        range.or(self.spp.map(NonZeroU32::get))
    }

    /// Index of the first sample in the whole picture.
    pub fn first_sample(&self) -> u32 {
        self.samples.map_or(0, |range| range.first)
    }
}

/// How far a render has come.
#[derive(Debug, Clone, Copy)]
pub struct Done {
    /// Index of the first sample in the whole picture.
    pub first_sample: u32,
    pub samples: u32,
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

/// A shard that would have fewer units has shorter ones.
const FEWEST_UNITS: u32 = 4;

/// Why a render has stopped. Displayed, it is the end of the sentence "stopped because …".
#[derive(Debug, Clone, PartialEq)]
pub enum StopReason {
    /// As many samples per pixel as were asked for.
    Spp(u32),
    Samples(SampleRange),
    /// No picture has more samples.
    MostSamples,
    /// The relative error is below this.
    RelativeError(f64),
    Time(Duration),
    /// The run's interruption.
    Interrupted,
}

impl std::fmt::Display for StopReason {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        match self {
            StopReason::Spp(count) => write!(f, "it has {count} samples per pixel"),
            StopReason::Samples(range) => write!(f, "samples {range} are done"),
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

/// Why to stop now; `None`: go on.
pub fn reason_to_stop(stop: &Stop, done: &Done) -> Option<StopReason> {
    if let Some(goal) = stop.count()
        && done.samples >= goal
    {
        let of_range = stop.samples.map(StopReason::Samples);
        return Some(of_range.unwrap_or(StopReason::Spp(goal)));
    }
    if let Some(goal) = stop.relative_error
        && done.units >= UNITS_TO_TRUST
        && done.relative_error <= goal
    {
        return Some(StopReason::RelativeError(goal));
    }
    if done.first_sample + done.samples >= SampleRange::MOST {
        return Some(StopReason::MostSamples);
    }
    if let Some(goal) = stop.time
        && done.units > 0
        && done.took >= goal
    {
        return Some(StopReason::Time(goal));
    }
    None
}

/// The time after which a cache's first paths or a picture's first sample are too late, if `time` is what was given: a
/// picture a little late is better than none.
pub(super) fn with_delay(time: Duration) -> Duration {
    const LEAST_DELAY: Duration = Duration::from_secs(5);
    time.saturating_add(time.max(LEAST_DELAY))
}

/// The largest power of two that is at most a sixteenth of `samples`; at least one.
pub fn sixteenth(samples: u32) -> u32 {
    1 << (samples / 16).max(1).ilog2()
}

/// Samples per pixel of the next unit.
pub fn next_unit(stop: &Stop, done: &Done) -> u32 {
    let at = done.first_sample + done.samples;
    let mut samples = sixteenth(at);
    if at > 0 {
        samples = samples.min(1 << at.trailing_zeros());
    }
    if let Some(goal) = stop.count() {
        if goal < FEWEST_UNITS * sixteenth(done.first_sample) {
            samples = samples.min(sixteenth(goal));
        }
        samples = samples.min(goal - done.samples);
    }
    if let Some(goal) = stop.time
        && done.samples > 0
    {
        let left = goal.saturating_sub(done.took).as_secs_f64();
        samples = samples.min((left / done.seconds_per_sample) as u32);
    }
    samples.max(1)
}

/// How many times as many samples as the picture has already are taken together at most: if they are interrupted, they
/// are lost.
pub const MOST_AT_ONCE: u32 = 3;

/// Seconds as a duration; the longest one if they are infinite or too many.
fn duration(seconds: f64) -> Duration {
    Duration::try_from_secs_f64(seconds).unwrap_or(Duration::MAX)
}

/// How many of the next units have the same size, where several of them together take less time than one by one.
pub fn units_together(stop: &Stop, done: &Done) -> u32 {
    let samples = next_unit(stop, done);
    let most = MOST_AT_ONCE * done.samples;
    let mut ahead = *done;
    let mut units = 0;
    loop {
        units += 1;
        ahead.samples += samples;
        ahead.units += 1;
        let seconds = done.seconds_per_sample * f64::from(samples);
        ahead.took = ahead.took.saturating_add(duration(seconds));
        // The error falls with the root of the number of samples.
        ahead.relative_error =
            done.relative_error * (f64::from(done.samples) / f64::from(ahead.samples)).sqrt();
        let goes_on = reason_to_stop(stop, &ahead).is_none() && next_unit(stop, &ahead) == samples;
        if !goes_on || (units + 1) * samples > most {
            return units;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn stop(spp: Option<u32>, seconds: Option<u64>, relative_error: Option<f64>) -> Stop {
        Stop {
            spp: spp.and_then(NonZeroU32::new),
            samples: None,
            time: seconds.map(Duration::from_secs),
            relative_error,
        }
    }

    fn done(samples: u32, units: u32, seconds: f64, relative_error: f64) -> Done {
        Done {
            first_sample: 0,
            samples,
            units,
            took: Duration::from_secs_f64(seconds),
            seconds_per_sample: seconds / f64::from(samples.max(1)),
            relative_error,
        }
    }

    #[test]
    fn a_reason_states_its_number_as_one_would_type_it() {
        for (goal, number) in [(0.02, "0.02"), (1e300, "1e300")] {
            let said = StopReason::RelativeError(goal).to_string();
            assert_eq!(said, format!("the relative error is below {number}"));
        }
    }

    #[test]
    fn units_add_up_to_the_samples_asked_for_and_are_enough_for_an_error() {
        for goal in [1, 2, 15, 16, 17, 100, 257, 4096] {
            let stop = stop(Some(goal), None, None);
            let mut now = done(0, 0, 0.0, f64::INFINITY);
            while reason_to_stop(&stop, &now).is_none() {
                now.samples += next_unit(&stop, &now);
                now.units += 1;
            }
            assert_eq!(now.samples, goal);
            assert!(now.units >= goal.min(16), "{goal}: {} units", now.units);
        }
    }

    #[test]
    fn units_are_powers_of_two_and_begin_at_multiples() {
        let stop = stop(None, None, Some(1e-9));
        let mut now = done(0, 0, 0.0, f64::INFINITY);
        while now.samples < 100_000 {
            let samples = next_unit(&stop, &now);
            assert!(samples.is_power_of_two() && now.samples.is_multiple_of(samples));
            assert!(now.samples < 16 || (16..64).contains(&(now.samples / samples)));
            now.samples += samples;
        }
    }

    /// Those that a single run has, if no shard ends within one of them or is short.
    #[test]
    fn shards_have_the_units_of_a_single_run() {
        let units = |first: u32, end: u32| {
            let stop = Stop {
                samples: Some(SampleRange { first, end }),
                ..Stop::default()
            };
            let mut now = Done {
                first_sample: first,
                ..done(0, 0, 0.0, f64::INFINITY)
            };
            let mut units = Vec::new();
            while reason_to_stop(&stop, &now).is_none() {
                let samples = next_unit(&stop, &now);
                units.push([first + now.samples, samples]);
                now.samples += samples;
            }
            units
        };
        let bounds = [0, 64, 200, 512, 1024];
        let shards = bounds.windows(2).flat_map(|ends| units(ends[0], ends[1]));
        assert_eq!(shards.collect::<Vec<_>>(), units(0, 1024));
        let odd = units(300, 777);
        let (last, before) = odd.split_last().unwrap();
        for [first, samples] in before {
            assert!(samples.is_power_of_two() && first.is_multiple_of(*samples));
        }
        assert_eq!(*last, [768, 9], "the last unit takes what is left");
        for [first, end] in [[256, 272], [4096, 4224], [1_000_000, 1_000_016]] {
            let few = units(first, end).len();
            assert!((16..=32).contains(&few), "{few} from {first} to {end}");
        }
    }

    #[test]
    fn units_together_are_those_that_come_one_by_one() {
        let stop = stop(Some(100), None, None);
        let mut now = done(0, 0, 0.0, f64::INFINITY);
        let mut one_by_one = now;
        let mut bundles = Vec::new();
        while reason_to_stop(&stop, &now).is_none() {
            let (samples, units) = (next_unit(&stop, &now), units_together(&stop, &now));
            for _ in 0..units {
                assert_eq!(next_unit(&stop, &one_by_one), samples);
                one_by_one.samples += samples;
            }
            now.samples += samples * units;
            bundles.push([samples, units]);
        }
        assert_eq!(bundles, [[1, 1], [1, 3], [1, 12], [1, 16], [2, 16], [4, 9]]);
    }

    #[test]
    fn no_more_units_are_begun_together_than_are_asked_for() {
        let in_time = stop(None, Some(10), None);
        assert_eq!(units_together(&in_time, &done(8, 8, 8.0, 0.1)), 2);
        let to_error = stop(None, None, Some(0.1));
        assert_eq!(units_together(&to_error, &done(16, 16, 1.0, 0.12)), 8);
    }

    #[test]
    fn the_error_counts_only_once_it_can_be_trusted() {
        let stop = stop(None, None, Some(0.1));
        assert!(reason_to_stop(&stop, &done(15, 15, 1.0, 0.01)).is_none());
        assert!(reason_to_stop(&stop, &done(16, 16, 1.0, 0.01)).is_some());
        assert!(reason_to_stop(&stop, &done(16, 16, 1.0, f64::NAN)).is_none());
    }

    /// Its mean counts no further.
    #[test]
    fn a_picture_ends_with_the_last_sample_that_it_can_have() {
        let stop = stop(None, Some(u64::MAX), Some(1e-9));
        let most = f64::from(SampleRange::MOST);
        let mut now = done(0, 0, 0.0, f64::INFINITY);
        while reason_to_stop(&stop, &now).is_none() {
            assert!(units_together(&stop, &now) >= 1);
            now.samples += next_unit(&stop, &now);
            now.took = Duration::from_secs_f64(f64::from(now.samples) / most);
            now.seconds_per_sample = 1.0 / most;
            now.units += 1;
        }
        assert_eq!(now.samples, SampleRange::MOST);
    }

    #[test]
    fn a_unit_ends_before_the_time_is_over() {
        let stop = stop(None, Some(10), None);
        assert_eq!(next_unit(&stop, &done(1600, 64, 9.9, 0.1)), 16);
        let mut after_filling = done(4, 4, 5.0, 0.1);
        after_filling.seconds_per_sample = 0.1;
        assert_eq!(units_together(&stop, &after_filling), 12);
    }
}
