//! Whether a cache is worth its filling, by two forecasts.

use super::forecast::{CachedForecast, Forecast};
use super::task::Task;

/// With a cache, an error is reached later than forecast: whether the cache is good enough is checked only when its paths
/// have doubled, and is uncertain itself. So the forecast time is multiplied by this factor, and a time limit is divided by
/// it.
const LATE: f64 = 1.2;

/// What two forecasts say of a cache.
pub struct Verdict {
    /// Whether the cache is worth its filling.
    pub cache_is_better: bool,
    /// Why, as the end of a sentence; it is meant for a rival without a cache.
    pub said: String,
}

/// Compares a cache with no cache, or with another cache: `rival` is the forecast of that. `head_start` is what going on
/// with the cache saves, in seconds: the time that its filling has taken so far, and the time that returning to the rival
/// would take.
pub fn verdict(
    rival: &Forecast,
    cached: &CachedForecast,
    task: &Task<'_>,
    head_start: f64,
) -> Verdict {
    let Task { stop, pictures, .. } = *task;
    if let Some(error) = stop.relative_error {
        let without = rival.seconds_to(error, pictures);
        let with = cached.seconds_to(error, pictures);
        if without.min(with) <= task.seconds() {
            let said = format!(
                "a relative error of {error} is expected after {} with a cache and {} without one",
                seconds(with),
                seconds(without)
            );
            return Verdict {
                cache_is_better: LATE * with < without + head_start,
                said,
            };
        }
    }
    let time = stop.time.map_or(f64::INFINITY, |time| time.as_secs_f64());
    let without = rival.error_after(time, pictures);
    let with = cached.error_after(time / LATE, pictures);
    let said = format!(
        "after {time} s a relative error of {} is expected with a cache and of {} without one",
        in_words(with),
        in_words(without)
    );
    Verdict {
        cache_is_better: with < without,
        said,
    }
}

fn seconds(expected: f64) -> String {
    if expected.is_finite() {
        format!("{expected:.1} s")
    } else {
        "an unknown time".into()
    }
}

/// An error that is expected.
fn in_words(error: f64) -> String {
    if error.is_finite() {
        format!("{error:.4}")
    } else {
        "unknown size".into()
    }
}

#[cfg(test)]
mod tests {
    use std::sync::atomic::AtomicBool;
    use std::time::Duration;

    use super::super::forecast::SampleForecast;
    use super::super::forecast::examples::{CACHED, UNCACHED};
    use super::super::stop::Stop;
    use super::*;

    static GOES_ON: AtomicBool = AtomicBool::new(false);

    fn is_chosen(cached: CachedForecast, stop: Stop, pictures: u32, head_start: f64) -> bool {
        let task = Task {
            stop,
            pictures,
            interrupt: &GOES_ON,
        };
        verdict(&Forecast::Uncached(UNCACHED), &cached, &task, head_start).cache_is_better
    }

    fn is_cached(stop: Stop, pictures: u32) -> bool {
        is_chosen(CACHED, stop, pictures, 0.0)
    }

    #[test]
    fn a_cache_is_for_pictures_that_have_to_be_good_or_many() {
        let to = |error| Stop {
            relative_error: Some(error),
            ..Stop::default()
        };
        assert!(!is_cached(to(0.2), 1));
        assert!(is_cached(to(0.2), 100));
        assert!(is_cached(to(0.02), 1));
        // Most of its filling is done.
        assert!(is_chosen(CACHED, to(0.2), 1, 10.0));
    }

    /// A cache through which the first sample would be too late is of no use, however good it would be.
    #[test]
    fn filling_leaves_time_for_a_sample() {
        let late = CachedForecast {
            samples: SampleForecast {
                seconds_per_sample: 8.0,
                variance: 1e-4,
                ..CACHED.samples
            },
            ..CACHED
        };
        assert!(!is_chosen(
            late,
            Stop::after(Duration::from_secs(6)),
            1,
            0.0
        ));
        assert!(is_chosen(
            late,
            Stop::after(Duration::from_secs(60)),
            1,
            0.0
        ));
    }

    #[test]
    fn where_the_time_ends_first_the_error_then_decides() {
        let both = |seconds| Stop {
            relative_error: Some(1e-4),
            ..Stop::after(Duration::from_secs(seconds))
        };
        assert!(is_cached(both(60), 1));
        let slow = CachedForecast {
            samples: SampleForecast {
                seconds_per_sample: 3.0,
                ..CACHED.samples
            },
            ..CACHED
        };
        assert!(!is_chosen(slow, both(60), 1, 0.0));
    }
}
