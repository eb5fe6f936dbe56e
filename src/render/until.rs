//! The condition on which work that takes many dispatches stops.

use std::sync::atomic::{AtomicBool, Ordering};
use std::time::{Duration, Instant};

/// Work ends with the dispatch under way once a flag is raised or a moment has come.
#[derive(Debug, Clone, Copy)]
pub struct Until<'a> {
    /// `None` for work that an interruption has to wait for.
    pub interrupt: Option<&'a AtomicBool>,
    pub deadline: Option<Instant>,
}

impl<'a> Until<'a> {
    /// Ends at the interruption, or after `time`; `None`, or a time that the clock cannot count, sets no deadline.
    pub fn within(interrupt: Option<&'a AtomicBool>, time: Option<Duration>) -> Until<'a> {
        Until {
            interrupt,
            deadline: time.and_then(|time| Instant::now().checked_add(time)),
        }
    }
}

impl Until<'_> {
    /// Work goes on to its end.
    pub const NEVER: Until<'static> = Until {
        interrupt: None,
        deadline: None,
    };

    pub fn is_over(&self) -> bool {
        self.interrupt
            .is_some_and(|flag| flag.load(Ordering::Relaxed))
            || self.deadline.is_some_and(|at| Instant::now() >= at)
    }
}

impl<'a> From<&'a AtomicBool> for Until<'a> {
    fn from(interrupt: &'a AtomicBool) -> Until<'a> {
        Until {
            interrupt: Some(interrupt),
            deadline: None,
        }
    }
}
