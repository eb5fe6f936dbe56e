//! When a render estimates the error of its picture.
//!
//! An estimate downloads the picture while the device waits: at 1024², a fast GPU traces many units of samples in that time. So
//! one is made when the error may have reached the goal, and otherwise so rarely that all of them take a twentieth of the time.

use std::time::Duration;

use super::stop::{Sampled, Stop};

/// The least time between two estimates that only the progress needs, since no stop depends on them.
const PROGRESS_INTERVAL: Duration = Duration::from_millis(500);
/// The time between two estimates that are not due for another reason, as a multiple of the time that one takes.
const INTERVAL_IN_ESTIMATES: u32 = 20;

/// The estimates of a render so far.
pub struct Estimates {
    /// The next one is due at this time, if not before.
    next: Duration,
    /// Samples of each pixel, and the error, at the last estimate by which a picture may end.
    last: Option<(u32, f64)>,
}

impl Estimates {
    /// Of a picture on which so much time has been spent.
    pub fn from(took: Duration) -> Estimates {
        Estimates {
            next: took + PROGRESS_INTERVAL,
            last: None,
        }
    }

    /// Whether the error has to be estimated now.
    pub fn is_due(&self, stop: &Stop, so_far: &Sampled) -> bool {
        so_far.took >= self.next || self.may_be_reached(stop, so_far)
    }

    /// Whether the error may be below the goal. It falls as 1/√n for independent samples, and never faster than 1/n.
    fn may_be_reached(&self, stop: &Stop, so_far: &Sampled) -> bool {
        match (stop.relative_error, self.last) {
            (Some(goal), Some((samples, error))) => {
                error * f64::from(samples) <= goal * f64::from(so_far.samples)
            }
            (Some(_), None) => stop.may_end_by_error(so_far.units),
            (None, _) => false,
        }
    }

    /// To be called after an estimate, which took so long and has been entered in `so_far`.
    pub fn made(&mut self, stop: &Stop, so_far: &Sampled, estimate: Duration) {
        let interval = INTERVAL_IN_ESTIMATES * estimate;
        self.next = so_far.took
            + match stop.relative_error {
                Some(_) => interval,
                None => interval.max(PROGRESS_INTERVAL),
            };
        if stop.may_end_by_error(so_far.units) && so_far.relative_error.is_finite() {
            self.last = Some((so_far.samples, so_far.relative_error));
        }
    }
}

#[cfg(test)]
mod tests {
    use super::super::stop::examples::{sampled, stop};
    use super::*;

    const ESTIMATE: Duration = Duration::from_millis(100);

    fn after(stop: &Stop, so_far: &Sampled) -> Estimates {
        let mut estimates = Estimates::from(Duration::ZERO);
        estimates.made(stop, so_far, ESTIMATE);
        estimates
    }

    #[test]
    fn it_is_estimated_once_it_can_be_trusted() {
        let stop = stop(None, None, Some(0.02));
        let fresh = Estimates::from(Duration::ZERO);
        assert!(!fresh.is_due(&stop, &sampled(15, 15, 0.1, f64::INFINITY)));
        assert!(fresh.is_due(&stop, &sampled(16, 16, 0.1, f64::INFINITY)));
        let too_early = after(&stop, &sampled(4, 4, 0.1, 1.0));
        assert!(too_early.is_due(&stop, &sampled(16, 16, 0.1, 1.0)));
    }

    #[test]
    fn it_is_estimated_again_when_it_may_have_reached_the_goal() {
        let stop = stop(None, None, Some(0.02));
        let estimates = after(&stop, &sampled(16, 16, 0.1, 0.08));
        assert!(!estimates.is_due(&stop, &sampled(63, 40, 0.5, 0.08)));
        assert!(estimates.is_due(&stop, &sampled(64, 41, 0.5, 0.08)));
    }

    /// Its error may have been overestimated: then a render goes on for a twentieth of its time too long.
    #[test]
    fn it_is_estimated_from_time_to_time() {
        for error in [None, Some(1e-6)] {
            let stop = stop(None, None, error);
            let estimates = after(&stop, &sampled(16, 16, 0.1, 0.08));
            assert!(!estimates.is_due(&stop, &sampled(20, 20, 2.0, 0.08)));
            assert!(estimates.is_due(&stop, &sampled(21, 21, 2.1, 0.08)));
        }
    }
}
