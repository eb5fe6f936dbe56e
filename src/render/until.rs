//! The condition on which work that takes many dispatches stops.

use std::sync::atomic::{AtomicBool, Ordering};
use std::time::Instant;

/// Work ends with the dispatch under way once a flag is raised or a moment has come.
#[derive(Debug, Clone, Copy)]
pub struct Until<'a> {
    pub interrupt: &'a AtomicBool,
    pub deadline: Option<Instant>,
}

impl Until<'_> {
    pub fn is_over(&self) -> bool {
        self.interrupt.load(Ordering::Relaxed)
            || self.deadline.is_some_and(|at| Instant::now() >= at)
    }
}

impl<'a> From<&'a AtomicBool> for Until<'a> {
    fn from(interrupt: &'a AtomicBool) -> Until<'a> {
        Until {
            interrupt,
            deadline: None,
        }
    }
}
