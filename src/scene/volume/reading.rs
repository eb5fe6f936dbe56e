//! How far a volume has been read, for someone who waits on another thread and may lose patience.

use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};

use super::header::Parsed;

#[derive(Debug, Default)]
pub struct Reading {
    /// Bytes, decompressed.
    done: AtomicU64,
    all: AtomicU64,
    is_stopped: AtomicBool,
}

impl Reading {
    /// From 0 to 1.
    pub fn share(&self) -> f64 {
        let done = self.done.load(Ordering::Relaxed) as f64;
        done / (self.all.load(Ordering::Relaxed) as f64).max(1.0)
    }

    /// The voxels are no longer wanted: reading them ends with an error.
    pub fn stop(&self) {
        self.is_stopped.store(true, Ordering::Relaxed);
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
