//! How soon an input is seen: the time from its arrival to the first frame that shows its effect.

use std::time::Instant;

use serde::Serialize;

use super::recent::Recent;

#[derive(Default)]
pub struct Response {
    /// Frames so far.
    presented: u64,
    /// The first input that the interface has not processed yet.
    received: Option<Arrival>,
    /// The first input whose effect has not been shown yet.
    awaited: Option<Arrival>,
    frames: Recent,
    ms: Recent,
}

#[derive(Clone, Copy)]
struct Arrival {
    at: Instant,
    /// Frames presented before the input arrived.
    presented: u64,
}

/// Latency in frames and milliseconds; 1 frame is the next one presented after the input's arrival. Of several inputs
/// together, the first counts. Changes for which passes had to be compiled do not count.
#[derive(Serialize)]
pub struct ResponseStats {
    inputs: usize,
    frames_median: f64,
    frames_max: Option<f64>,
    ms_median: f64,
    ms_max: Option<f64>,
}

impl Response {
    pub fn received(&mut self) {
        self.received.get_or_insert(Arrival {
            at: Instant::now(),
            presented: self.presented,
        });
    }

    /// Notes that the interface has processed all inputs that were received.
    pub fn processed(&mut self, changes_picture: bool) {
        let received = self.received.take().filter(|_| changes_picture);
        self.awaited = self.awaited.or(received);
    }

    /// Notes that a frame was presented, with a new picture or with the same one again.
    pub fn presented(&mut self, has_picture: bool) {
        self.presented += 1;
        if let Some(arrival) = self.awaited.take_if(|_| has_picture) {
            self.frames.add((self.presented - arrival.presented) as f64);
            self.ms.add(arrival.at.elapsed().as_secs_f64() * 1e3);
        }
    }

    pub fn stats(&self) -> ResponseStats {
        ResponseStats {
            inputs: self.frames.count,
            frames_median: self.frames.quantile(0.5),
            frames_max: self.frames.highest,
            ms_median: self.ms.quantile(0.5),
            ms_max: self.ms.highest,
        }
    }
}
