//! How far a volume has been read and what that took, for someone who waits on another thread and may
//! lose patience.

use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};
use std::time::Duration;

use super::header::Parsed;

#[derive(Debug, Default)]
pub struct Reading {
    /// Bytes, decompressed.
    done: AtomicU64,
    all: AtomicU64,
    took_ns: AtomicU64,
    is_stopped: AtomicBool,
}

impl Reading {
    /// From 0 to 1.
    pub fn share(&self) -> f64 {
        let done = self.done.load(Ordering::Relaxed) as f64;
        done / (self.all.load(Ordering::Relaxed) as f64).max(1.0)
    }

    /// By the reading and inflating of the file; making voxels of it is not part of that.
    pub fn took(&self) -> Duration {
        Duration::from_nanos(self.took_ns.load(Ordering::Relaxed))
    }

    /// The voxels are no longer wanted: reading them ends with an error.
    pub fn stop(&self) {
        self.is_stopped.store(true, Ordering::Relaxed);
    }

    pub(super) fn spend(&self, time: Duration) {
        self.took_ns
            .fetch_add(time.as_nanos() as u64, Ordering::Relaxed);
    }

    pub(super) fn reach(&self, done: u64, all: u64) -> Parsed<()> {
        self.done.store(done, Ordering::Relaxed);
        self.all.store(all, Ordering::Relaxed);
        match self.is_stopped.load(Ordering::Relaxed) {
            true => Err("reading was cancelled".into()),
            false => Ok(()),
        }
    }
}
