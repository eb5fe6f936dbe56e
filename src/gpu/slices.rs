//! Slices of a pass that would keep the device busy for too long: how many rows of workgroups run in one submission, by what
//! the last ones took.
//!
//! Rows differ: those of a picture's border may cost nothing, and the next ones all of its time. So a slice holds as many rows
//! as stay within its time if each of their workgroups takes as long as the slowest so far, of this run of the pass and of the
//! one before. In the first run, where nothing is known of the rows to come, it holds an eighth of them at most.

use std::time::Duration;

/// Time that a slice of work should take where no frame of a window is due, in milliseconds.
pub const SLICE_MS: f64 = 50.0;

/// Of a pass of which nothing is known, the first slice has this part of the rows.
const FIRST: u32 = 64;
/// And no slice of it has a larger part than this.
const LARGEST: u32 = 8;

/// Progress of a pass that runs in slices.
#[derive(Debug, Clone, Copy)]
pub struct Slices {
    /// Time that a slice should take.
    target_ms: f64,
    /// The first row of the next slice.
    begin: u32,
    /// Rows of the next slice, where it runs again.
    again: Option<u32>,
    /// Rows of the last slice, or 0.
    rows: u32,
    /// `slowest_ms()`, or 0.
    slowest_ms: f64,
}

/// The rows of a pass.
#[derive(Debug, Clone, Copy)]
pub(super) struct Rows {
    pub all: u32,
    /// Workgroups in each.
    pub workgroups: u32,
    /// The `slowest_ms` of the last whole run of the pass, if there was one.
    pub slowest_ms: Option<f64>,
}

impl Slices {
    pub fn new(target_ms: f64) -> Slices {
        Slices {
            target_ms,
            begin: 0,
            again: None,
            rows: 0,
            slowest_ms: 0.0,
        }
    }

    /// The first row of the next slice, and its number of rows.
    pub(super) fn next(&self, rows: Rows) -> (u32, u32) {
        let slowest_ms = rows.slowest_ms.unwrap_or(0.0).max(self.slowest_ms);
        let in_time = self.target_ms / (slowest_ms * f64::from(rows.workgroups));
        let known = match rows.slowest_ms {
            Some(_) => rows.all,
            None => (2 * self.rows).clamp(rows.all.div_ceil(FIRST), rows.all.div_ceil(LARGEST)),
        };
        let count = self.again.unwrap_or(known.min(in_time as u32).max(1));
        (self.begin, count.min(rows.all - self.begin))
    }

    /// Goes on behind a slice of `count` rows, which took so long. Returns whether it was the last.
    pub(super) fn took(&mut self, rows: Rows, count: u32, time: Duration) -> bool {
        // Some drivers finish compiling a pass when it first runs, which tells nothing of its rows.
        let may_have_compiled = self.begin == 0 && rows.slowest_ms.is_none();
        if !may_have_compiled {
            let ms = time.as_secs_f64() * 1e3;
            let workgroups = f64::from(count) * f64::from(rows.workgroups);
            self.slowest_ms = self.slowest_ms.max(ms / workgroups);
        }
        self.begin += count;
        self.rows = count;
        self.again = None;
        self.begin == rows.all
    }

    /// What a workgroup has taken in the slice where it took longest, in milliseconds, as far as is known.
    pub(super) fn slowest_ms(&self) -> Option<f64> {
        Some(self.slowest_ms).filter(|&ms| ms > 0.0)
    }

    /// Before the slice between `self` and `behind`, which runs again.
    pub fn once_more(self, behind: &Slices) -> Slices {
        Slices {
            again: Some(behind.begin - self.begin),
            ..self
        }
    }

    /// The same progress; its workgroups count as no faster than those of the other one.
    pub fn no_faster_than(self, other: &Slices) -> Slices {
        Slices {
            slowest_ms: self.slowest_ms.max(other.slowest_ms),
            ..self
        }
    }

    /// Starts over with the first slice, in slices that take `target_ms` each.
    pub fn restart(&mut self, target_ms: f64) {
        *self = Slices::new(target_ms);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const WORKGROUPS: u32 = 40;

    /// Runs a pass again and again whose rows take so many milliseconds each, each submission 0.1 more, and the first of all
    /// 500 that are not in what is returned: the times of the slices of each run.
    fn runs(rows_ms: &[f64], target_ms: f64) -> [Vec<f64>; 3] {
        let mut slowest_ms = None;
        [(); 3].map(|()| {
            let rows = Rows {
                all: rows_ms.len() as u32,
                workgroups: WORKGROUPS,
                slowest_ms,
            };
            let mut slices = Slices::new(target_ms);
            let mut times = Vec::new();
            loop {
                let (begin, count) = slices.next(rows);
                let rows_ms = &rows_ms[begin as usize..][..count as usize];
                let ms = 0.1 + rows_ms.iter().sum::<f64>();
                times.push(ms);
                let compiling = if slowest_ms.is_none() && begin == 0 {
                    500.0
                } else {
                    0.0
                };
                let took = Duration::from_secs_f64((ms + compiling) / 1e3);
                if slices.took(rows, count, took) {
                    slowest_ms = slices.slowest_ms();
                    return times;
                }
            }
        })
    }

    fn longest(times: &[f64]) -> f64 {
        times.iter().fold(0.0, |a, &b| a.max(b))
    }

    /// A picture of four seconds whose upper half is empty, or its lower one.
    #[test]
    fn rows_that_cost_nothing_are_no_measure_of_others() {
        let mut rows_ms = [0.0; 270];
        rows_ms[135..].fill(4e3 / 135.0);
        for _ in 0..2 {
            let [first, later @ ..] = runs(&rows_ms, 50.0).map(|times| longest(&times));
            assert!(first < 1.2e3, "{first} ms");
            assert!(later.iter().all(|&ms| ms < 65.0), "{later:?} ms");
            rows_ms.reverse();
        }
    }

    #[test]
    fn a_cheap_pass_soon_runs_at_once() {
        let [first, later @ ..] = runs(&[0.5 / 128.0; 128], 50.0).map(|times| times.len());
        assert!(first <= 12, "{first}");
        assert_eq!(later, [1, 1]);
    }

    /// Whatever has become known of the pass meanwhile.
    #[test]
    fn a_slice_that_runs_again_has_the_same_rows() {
        let rows = Rows {
            all: 270,
            workgroups: WORKGROUPS,
            slowest_ms: None,
        };
        let before = Slices::new(50.0);
        let (begin, count) = before.next(rows);
        let mut behind = before;
        behind.took(rows, count, Duration::from_millis(1));
        let known = Rows {
            slowest_ms: Some(1e-3),
            ..rows
        };
        let mut again = before.once_more(&behind);
        assert_eq!(again.next(known), (begin, count));
        again.took(known, count, Duration::from_millis(1));
        assert_eq!(again.next(known).0, count);
        assert!(again.next(known).1 > count);
    }

    #[test]
    fn slices_take_their_time() {
        for times in runs(&[5.0; 270], 50.0) {
            let most = 270.0 * 5.0 / 50.0 * 1.5;
            assert!(longest(&times) < 60.0, "{times:?}");
            assert!((times.len() as f64) < most, "{times:?}");
        }
    }
}
