//! The most memory that a window and its renderers were ever planned to take.

use std::sync::Arc;
use std::sync::atomic::{AtomicU64, Ordering};

/// Shared with the threads that prepare scenes: one whose scene is not wanted any more has taken memory, too.
#[derive(Clone, Default)]
pub struct Planned(Arc<AtomicU64>);

impl Planned {
    /// Notes a plan for everything, the window included.
    pub fn note(&self, bytes: u64) {
        self.0.fetch_max(bytes, Ordering::Relaxed);
    }

    pub fn most_bytes(&self) -> u64 {
        self.0.load(Ordering::Relaxed)
    }
}
