//! How many samples to take next.
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
//! (`render/picture/units.rs`, `render/picture/halves.rs`).

use std::time::Duration;

use super::stop::{Sampled, Stop};

/// A shard that would have fewer units has shorter ones.
const FEWEST_UNITS: u32 = 4;

/// The largest power of two that is at most a sixteenth of `samples`; at least one.
pub fn sixteenth(samples: u32) -> u32 {
    1 << (samples / 16).max(1).ilog2()
}

/// Samples per pixel of the next unit.
pub fn next_unit(stop: &Stop, so_far: &Sampled) -> u32 {
    let at = so_far.first_sample + so_far.samples;
    let mut samples = sixteenth(at);
    if at > 0 {
        samples = samples.min(1 << at.trailing_zeros());
    }
    if let Some(goal) = stop.count() {
        if goal < FEWEST_UNITS * sixteenth(so_far.first_sample) {
            samples = samples.min(sixteenth(goal));
        }
        samples = samples.min(goal - so_far.samples);
    }
    if let Some(goal) = stop.time
        && so_far.samples > 0
    {
        let left = goal.saturating_sub(so_far.took).as_secs_f64();
        samples = samples.min((left / so_far.seconds_per_sample) as u32);
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
pub fn units_together(stop: &Stop, so_far: &Sampled) -> u32 {
    let samples = next_unit(stop, so_far);
    let most = MOST_AT_ONCE * so_far.samples;
    let mut ahead = *so_far;
    let mut units = 0;
    loop {
        units += 1;
        ahead.samples += samples;
        ahead.units += 1;
        let seconds = so_far.seconds_per_sample * f64::from(samples);
        ahead.took = ahead.took.saturating_add(duration(seconds));
        // The error falls with the root of the number of samples.
        ahead.relative_error =
            so_far.relative_error * (f64::from(so_far.samples) / f64::from(ahead.samples)).sqrt();
        let goes_on = stop.reason(&ahead).is_none() && next_unit(stop, &ahead) == samples;
        if !goes_on || (units + 1) * samples > most {
            return units;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::super::sample_range::SampleRange;
    use super::super::stop::Samples;
    use super::super::stop::examples::{sampled, stop};
    use super::*;

    #[test]
    fn units_add_up_to_the_samples_asked_for_and_are_enough_for_an_error() {
        for goal in [1, 2, 15, 16, 17, 100, 257, 4096] {
            let stop = stop(Some(goal), None, None);
            let mut now = sampled(0, 0, 0.0, f64::INFINITY);
            while stop.reason(&now).is_none() {
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
        let mut now = sampled(0, 0, 0.0, f64::INFINITY);
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
                samples: Some(Samples::Shard(SampleRange { first, end })),
                ..Stop::default()
            };
            let mut now = Sampled {
                first_sample: first,
                ..sampled(0, 0, 0.0, f64::INFINITY)
            };
            let mut units = Vec::new();
            while stop.reason(&now).is_none() {
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
        let mut now = sampled(0, 0, 0.0, f64::INFINITY);
        let mut one_by_one = now;
        let mut bundles = Vec::new();
        while stop.reason(&now).is_none() {
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
        assert_eq!(units_together(&in_time, &sampled(8, 8, 8.0, 0.1)), 2);
        let to_error = stop(None, None, Some(0.1));
        assert_eq!(units_together(&to_error, &sampled(16, 16, 1.0, 0.12)), 8);
    }

    /// Its mean counts no further.
    #[test]
    fn a_picture_ends_with_the_last_sample_that_it_can_have() {
        let stop = stop(None, Some(u64::MAX), Some(1e-9));
        let most = f64::from(SampleRange::MOST);
        let mut now = sampled(0, 0, 0.0, f64::INFINITY);
        while stop.reason(&now).is_none() {
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
        assert_eq!(next_unit(&stop, &sampled(1600, 64, 9.9, 0.1)), 16);
        let mut after_filling = sampled(4, 4, 5.0, 0.1);
        after_filling.seconds_per_sample = 0.1;
        assert_eq!(units_together(&stop, &after_filling), 12);
    }
}
