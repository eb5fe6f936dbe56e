//! The progress of reading a volume and the time that it took, for another thread that waits and may stop it.

use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};
use std::time::Duration;

use super::parsed::Parsed;

#[derive(Debug, Default)]
pub struct Reading {
    /// Decompressed bytes of the wanted voxels: those that have been read, and all.
    done: AtomicU64,
    all: AtomicU64,
    took_ns: AtomicU64,
    is_stopped: AtomicBool,
}

impl Reading {
    /// The part of the voxels that has been read, from 0 to 1.
    pub fn share(&self) -> f64 {
        let done = self.done.load(Ordering::Relaxed) as f64;
        done / (self.all.load(Ordering::Relaxed) as f64).max(1.0)
    }

    /// Stops the reading with an error: the voxels are no longer wanted.
    pub fn stop(&self) {
        self.is_stopped.store(true, Ordering::Relaxed);
    }

    /// The time that went into reading, inflating and converting voxels.
    pub fn took(&self) -> Duration {
        Duration::from_nanos(self.took_ns.load(Ordering::Relaxed))
    }

    pub(super) fn expect(&self, bytes: u64) {
        self.all.store(bytes, Ordering::Relaxed);
    }

    pub(super) fn advance(&self, bytes: u64) -> Parsed<()> {
        self.done.fetch_add(bytes, Ordering::Relaxed);
        if self.is_stopped.load(Ordering::Relaxed) {
            Err("reading was cancelled".into())
        } else {
            Ok(())
        }
    }

    pub(super) fn spend(&self, time: Duration) {
        let ns = time.as_nanos() as u64;
        self.took_ns.fetch_add(ns, Ordering::Relaxed);
    }
}
