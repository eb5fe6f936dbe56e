//! Ctrl-C: it ends a render at the end of the dispatch under way, and what there is is written.

use std::sync::atomic::{AtomicBool, Ordering};

use crate::engine::{Progress, Run, Stop};
use crate::error::INTERRUPTED_STATUS;

pub static INTERRUPTED: AtomicBool = AtomicBool::new(false);

pub fn catch_interrupts() {
    // Fails only where a handler is set already, and that one does the same.
    let _ = ctrlc::set_handler(|| INTERRUPTED.store(true, Ordering::Relaxed));
}

pub fn is_interrupted() -> bool {
    INTERRUPTED.load(Ordering::Relaxed)
}

/// The exit status of a command that has written what there is.
pub fn status() -> u8 {
    match is_interrupted() {
        true => INTERRUPTED_STATUS,
        false => 0,
    }
}

/// A run that Ctrl-C ends.
pub fn run(stop: Stop, progress: &mut dyn FnMut(Progress)) -> Run<'_> {
    Run {
        stop,
        interrupt: &INTERRUPTED,
        progress,
    }
}
