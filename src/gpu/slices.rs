//! Slices of a pass that would keep the device busy for too long: how many workgroups run in one submission, by how long the
//! last ones took.

use std::time::Duration;

/// Time that a slice of work should take where no frame of a window is due, in milliseconds.
pub const SLICE_MS: f64 = 50.0;

/// Progress of a pass that runs in slices.
#[derive(Debug, Clone, Copy)]
pub struct Slices {
    /// Time that a slice should take.
    target_ms: f64,
    begin: u32,
    /// Workgroups in the next slice along the axis of the slices.
    count: u32,
}

impl Slices {
    pub fn new(target_ms: f64) -> Slices {
        Slices {
            target_ms,
            begin: 0,
            count: 1,
        }
    }

    /// The first workgroup of the next slice along the axis, and how many there are, of `all`.
    pub(super) fn next(&self, all: u32) -> (u32, u32) {
        (self.begin, self.count.min(all - self.begin))
    }

    /// Goes on behind a slice of `count` workgroups, which took so long.
    pub(super) fn took(&mut self, count: u32, time: Duration) {
        let growth = (self.target_ms / (time.as_secs_f64() * 1e3)).clamp(0.5, 8.0);
        self.begin += count;
        self.count = (f64::from(count) * growth).ceil() as u32;
    }

    /// Starts over with the first slice. It is as long as the next one would have been, scaled to the new
    /// `target_ms`.
    pub fn restart(&mut self, target_ms: f64) {
        self.count = (self.count as f64 * target_ms / self.target_ms).ceil() as u32;
        self.target_ms = target_ms;
        self.begin = 0;
    }
}
