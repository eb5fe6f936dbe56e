//! GPU times by pass name, gathered by the frame; passes never mention timing.

use std::time::Instant;

/// One run of a pass.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Span {
    pub pass: &'static str,
    /// Since the timings began. Vulkan's clocks are not calibrated against the host's here: the
    /// first pass of a frame is put where the host submitted it.
    pub start_us: f64,
    pub duration_us: f64,
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
