//! Whether a cache is worth its filling, by two forecasts.

use super::forecast::{CachedForecast, Forecast, SampleForecast};
use super::task::Task;

/// With a cache, an error is reached later than forecast: whether the cache is good enough is checked only when its paths
/// have doubled, and is uncertain itself. So the forecast time is multiplied by this factor, and a time limit is divided by
/// it.
const LATE: f64 = 1.2;

/// Forecasts with a cache and with its rival, which is no cache or another cache.
#[derive(Debug)]
pub enum Verdict {
    /// Seconds until all pictures have the relative error `to`.
    Seconds { to: f64, with: f64, without: f64 },
    /// Relative errors of pictures that take so many seconds each.
    Errors { after: f64, with: f64, without: f64 },
}

impl Verdict {
    /// Compares a cache with its rival by the time until pictures have the error that is asked for; by their errors at the
    /// end of the time if no error is asked for, or if neither reaches it in time.
    pub fn of(rival: &Forecast, cached: &CachedForecast, task: &Task<'_>) -> Verdict {
        let Task { stop, pictures, .. } = *task;
        if let Some(to) = stop.relative_error {
            let with = cached.seconds_to(to, pictures);
            let without = rival.seconds_to(to, pictures);
            if without.min(with) <= task.seconds() {
                return Verdict::Seconds { to, with, without };
            }
        }
        let after = stop.seconds();
        Verdict::Errors {
            after,
            with: cached.error_after(after / LATE, pictures),
            without: rival.error_after(after, pictures),
        }
    }

    /// Whether the cache is worth its filling. `head_start` is what going on with it saves, in seconds: the time that its
    /// filling has taken so far, and the time that returning to the rival would take.
    pub fn cache_is_better(&self, head_start: f64) -> bool {
        match *self {
            Verdict::Seconds { with, without, .. } => LATE * with < without + head_start,
            Verdict::Errors { with, without, .. } => with < without,
        }
    }

    /// What is expected, where the rival is no cache.
    fn beside_no_cache(&self) -> String {
        match *self {
            Verdict::Seconds { to, with, without } => format!(
                "a relative error of {to} is expected after {} with a cache and {} without one",
                seconds(with),
                seconds(without)
            ),
            Verdict::Errors {
                after,
                with,
                without,
            } => format!(
                "after {after} s a relative error of {} is expected with a cache and of {} without one",
                in_words(with),
                in_words(without)
            ),
        }
    }
}

/// Why a cache is chosen, or no cache: the end of a sentence.
pub fn reason(uncached: &SampleForecast, cached: &CachedForecast, task: &Task<'_>) -> String {
    let verdict = Verdict::of(&Forecast::Uncached(*uncached), cached, task);
    verdict.beside_no_cache()
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
        Verdict::of(&Forecast::Uncached(UNCACHED), &cached, &task).cache_is_better(head_start)
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

    #[test]
    fn a_reason_ends_a_sentence() {
        let reached = Verdict::Seconds {
            to: 0.02,
            with: 12.34,
            without: f64::INFINITY,
        };
        let expected = "a relative error of 0.02 is expected after 12.3 s with a cache and an unknown time without one";
        assert_eq!(reached.beside_no_cache(), expected);
        let errors = Verdict::Errors {
            after: 1.5,
            with: 0.012,
            without: f64::NAN,
        };
        let expected = "after 1.5 s a relative error of 0.0120 is expected with a cache and of unknown size without one";
        assert_eq!(errors.beside_no_cache(), expected);
    }
}
