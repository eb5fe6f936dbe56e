//! GPU times by pass name, gathered by the frame; passes never mention timing. What they do mention is the work that a
//! run has done, where it is known: only with that does a time say how far the device is from its limit.

use std::time::Instant;

/// What a run of a pass has done, counted. All zeros: nobody has counted.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub struct Work {
    /// Linearly filtered samples of a volume, by the device's filter or from eight texels.
    pub samples: u64,
    /// Reads of single texels.
    pub reads: u64,
    /// Writes of texels of four 32-bit floats.
    pub writes: u64,
    /// Bytes copied from one place in the device's memory to another.
    pub copied_bytes: u64,
}

impl Work {
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
}

/// One run of a pass.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Span {
    pub pass: &'static str,
    /// Since the timings began. Vulkan's clocks are not calibrated against the host's here: the
    /// first pass of a frame is put where the host submitted it.
    pub start_us: f64,
    pub duration_us: f64,
    pub work: Work,
}

/// Every run since the timings began, in order.
pub struct Timings {
    pub began: Instant,
    pub spans: Vec<Span>,
}

impl Default for Timings {
    fn default() -> Self {
        Timings {
            began: Instant::now(),
            spans: Vec::new(),
        }
    }
}

impl Timings {
    /// States the work of the last run of `pass`, which only the device could count.
    pub fn state_work(&mut self, pass: &str, work: Work) {
        let of_pass = |span: &&mut Span| span.pass == pass;
        if let Some(span) = self.spans.iter_mut().rev().find(of_pass) {
            span.work = work;
        }
    }
}
