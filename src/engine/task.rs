//! The pictures that a renderer is to make, as far as they are known beforehand.

use std::sync::atomic::{AtomicBool, Ordering};
use std::time::Duration;

use super::stop::Stop;
use crate::render::Until;

/// Pictures to be rendered.
#[derive(Debug, Clone, Copy)]
pub struct Task<'a> {
    pub stop: Stop,
    /// Pictures of the same light: the views of an orbit.
    pub pictures: u32,
    /// Setting this flag ends the trial; the engine that exists then goes on.
    pub interrupt: &'a AtomicBool,
}

impl<'a> Task<'a> {
    /// All pictures' time; infinite where it is not limited.
    pub(super) fn seconds(&self) -> f64 {
        f64::from(self.pictures) * self.stop.seconds()
    }

    pub(super) fn is_interrupted(&self) -> bool {
        self.interrupt.load(Ordering::Relaxed)
    }

    /// Until the interruption, or until so much time is over.
    pub(super) fn until(&self, time: Option<Duration>) -> Until<'a> {
        Until::within(Some(self.interrupt), time)
    }

    /// Until the interruption, or until a first sample is too late.
    pub(super) fn until_late(&self) -> Until<'a> {
        self.until(self.stop.late())
    }
}
