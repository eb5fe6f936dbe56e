//! GPU times by pass name, gathered by the frame; passes never mention timing. They state the work that a run has
//! done, where it is known: only with that does a time say how far the device is from its limit.

use std::time::Instant;

/// The work that a run of a pass has done, as counts; all are zero if nothing was counted.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub struct Work {
    /// Trilinear samples of a 3D image, from eight texels each.
    pub samples: u64,
    /// Reads of single texels.
    pub reads: u64,
    /// Writes of texels of four 32-bit floats.
    pub writes: u64,
    /// Bytes copied from one place in the device's memory to another.
    pub copied_bytes: u64,
}

impl Work {
    /// A copy of so many bytes from one place in the device's memory to another.
    pub fn copy(copied_bytes: u64) -> Work {
        Work {
            copied_bytes,
            ..Work::default()
        }
    }

    /// A fill of so many bytes of the device's memory: it moves half of what a copy of them reads and writes.
    pub fn fill(bytes: u64) -> Work {
        Work::copy(bytes.div_ceil(2))
    }

    /// Reads and writes of single texels.
    pub fn texels(reads: u64, writes: u64) -> Work {
        Work {
            reads,
            writes,
            ..Work::default()
        }
    }

    /// Trilinear samples of a 3D image.
    pub fn samples(samples: u64) -> Work {
        Work {
            samples,
            ..Work::default()
        }
    }

    pub fn is_known(&self) -> bool {
        *self != Work::default()
    }

    pub fn plus(self, other: Work) -> Work {
        Work {
            samples: self.samples + other.samples,
            reads: self.reads + other.reads,
            writes: self.writes + other.writes,
            copied_bytes: self.copied_bytes + other.copied_bytes,
        }
    }

    fn times(self, share: f64) -> Work {
        let part = |count: u64| (count as f64 * share).round() as u64;
        Work {
            samples: part(self.samples),
            reads: part(self.reads),
            writes: part(self.writes),
            copied_bytes: part(self.copied_bytes),
        }
    }
}

/// One run of a pass.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Span {
    pub pass: &'static str,
    /// Microseconds since the timings began. Vulkan's clocks are not calibrated against the host's here: the first
    /// pass of a frame is put where the host submitted it.
    pub start_us: f64,
    pub duration_us: f64,
    pub work: Work,
}

/// All runs of a pass since the timings began.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct PassTotal {
    pub pass: &'static str,
    pub runs: u64,
    pub duration_us: f64,
    pub work: Work,
    /// The time of those runs whose work has not been stated yet, and how many of them are kept.
    unstated_us: f64,
    unstated_kept: usize,
}

/// The most spans that are kept: a few megabytes.
const MOST_SPANS: usize = 1 << 16;

/// Everything that has run since the timings began: sums over all runs, and single runs in order. In a render that
/// goes on for hours, only every second run of each pass is kept, then every fourth, and so on, so that the kept
/// times need no more memory.
pub struct Timings {
    pub began: Instant,
    spans: Vec<Span>,
    passes: Vec<PassTotal>,
    /// Of each pass, the first run is kept, and then every `stride`-th.
    stride: u64,
}

impl Default for Timings {
    fn default() -> Self {
        Timings {
            began: Instant::now(),
            spans: Vec::new(),
            passes: Vec::new(),
            stride: 1,
        }
    }
}

impl Timings {
    pub(super) fn record(&mut self, span: Span) {
        let index = self.index_of(span.pass).unwrap_or_else(|| {
            self.passes.push(PassTotal {
                pass: span.pass,
                runs: 0,
                duration_us: 0.0,
                work: Work::default(),
                unstated_us: 0.0,
                unstated_kept: 0,
            });
            self.passes.len() - 1
        });
        let total = &mut self.passes[index];
        let is_kept = total.runs.is_multiple_of(self.stride);
        total.runs += 1;
        total.duration_us += span.duration_us;
        total.work = total.work.plus(span.work);
        if !span.work.is_known() {
            total.unstated_us += span.duration_us;
            total.unstated_kept += usize::from(is_kept);
        }
        if is_kept {
            self.spans.push(span);
        }
        if self.spans.len() >= MOST_SPANS {
            self.thin();
        }
    }

    /// Drops every second of the kept runs of each pass.
    fn thin(&mut self) {
        self.stride *= 2;
        let Timings { spans, passes, .. } = self;
        for total in passes {
            let kept = spans.iter().filter(|span| span.pass == total.pass).count();
            let stated = kept - total.unstated_kept;
            let mut seen = 0;
            spans.retain(|span| {
                seen += usize::from(span.pass == total.pass);
                span.pass != total.pass || seen % 2 == 1
            });
            total.unstated_kept = kept.div_ceil(2) - stated.div_ceil(2);
        }
    }

    fn index_of(&self, pass: &str) -> Option<usize> {
        self.passes.iter().position(|total| total.pass == pass)
    }

    /// States the work of all runs of `pass` since this was last done, where only the device could count it. Each run gets
    /// a share in proportion to its time.
    pub fn state_work(&mut self, pass: &str, work: Work) {
        let Some(index) = self.index_of(pass) else {
            return;
        };
        let total = &mut self.passes[index];
        total.work = total.work.plus(work);
        let unstated_us = std::mem::take(&mut total.unstated_us);
        let unstated = std::mem::take(&mut total.unstated_kept);
        let of_pass = self.spans.iter_mut().rev().filter(|span| span.pass == pass);
        for span in of_pass.take(unstated) {
            let share = span.duration_us / unstated_us;
            // Clocks are coarse: all may have taken no time.
            let share = if share.is_finite() {
                share
            } else {
                1.0 / unstated as f64
            };
            span.work = work.times(share);
        }
    }

    /// The runs that are kept, in order.
    pub fn spans(&self) -> &[Span] {
        &self.spans
    }

    /// All passes, in order of first appearance.
    pub fn passes(&self) -> &[PassTotal] {
        &self.passes
    }

    /// All runs of a pass, if there were any.
    pub fn total(&self, pass: &str) -> Option<&PassTotal> {
        self.index_of(pass).map(|index| &self.passes[index])
    }

    /// How many runs each kept run of a pass stands for.
    pub fn weight(&self, pass: &str) -> f64 {
        let runs = self.total(pass).map_or(0, |total| total.runs);
        runs as f64 / runs.div_ceil(self.stride).max(1) as f64
    }

    /// Returns the runs that are kept, and begins anew.
    pub fn take(&mut self) -> Vec<Span> {
        self.passes.clear();
        self.stride = 1;
        std::mem::take(&mut self.spans)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn span(pass: &'static str, duration_us: f64) -> Span {
        Span {
            pass,
            start_us: 0.0,
            duration_us,
            work: Work::default(),
        }
    }

    #[test]
    fn a_long_render_keeps_few_runs_and_all_sums() {
        const RUNS: u64 = 500_000;
        let read = Work::texels(3, 0);
        let mut timings = Timings::default();
        timings.record(span("once", 7.0));
        for n in 0..RUNS {
            timings.record(span("trace", n as f64));
            timings.state_work("trace", read);
            timings.record(span("fold", 1.0));
        }
        assert!(timings.spans().len() < MOST_SPANS);
        let total = timings.total("trace").expect("it ran");
        assert_eq!((total.runs, total.work.reads), (RUNS, 3 * RUNS));
        assert_eq!(total.duration_us, (RUNS * (RUNS - 1) / 2) as f64);
        assert_eq!(timings.weight("once"), 1.0);
        for pass in ["trace", "fold"] {
            let kept = timings.spans().iter().filter(|span| span.pass == pass);
            assert!(kept.clone().count() > MOST_SPANS / 8, "{pass}");
            let runs = timings.weight(pass) * kept.count() as f64;
            assert!((runs - RUNS as f64).abs() < 1e-3, "{pass}: {runs}");
        }
        let of_trace = timings.spans().iter().filter(|span| span.pass == "trace");
        assert!(of_trace.clone().all(|span| span.work == read));
        let ms: Vec<f64> = of_trace.map(|span| span.duration_us).collect();
        let median = ms[ms.len() / 2];
        assert!(
            (median / (0.5 * RUNS as f64) - 1.0).abs() < 0.01,
            "{median}"
        );
        assert_eq!(timings.take().len(), 2 * ms.len() + 1);
        assert!(timings.spans().is_empty() && timings.passes().is_empty());
    }

    #[test]
    fn runs_share_work_that_is_stated_of_all_of_them_by_their_times() {
        let mut timings = Timings::default();
        let read = |reads| Work::texels(reads, 0);
        timings.record(span("march", 1.0));
        timings.state_work("march", read(7));
        timings.record(span("march", 10.0));
        timings.record(span("other", 5.0));
        timings.record(span("march", 30.0));
        timings.state_work("march", read(80));
        let reads: Vec<_> = timings.spans().iter().map(|span| span.work.reads).collect();
        assert_eq!(reads, [7, 20, 0, 60]);
        assert_eq!(
            timings.total("march").map(|total| total.work),
            Some(read(87))
        );
    }
}
