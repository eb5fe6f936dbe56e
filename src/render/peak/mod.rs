//! The most that a device can do of each kind of work that rendering consists of, as a standard for the time of a
//! pass. `peak_rate.rs` measures it.
//!
//! A pass's share of the peak is the least time in which the device can do the pass's work, by [`Peak`], divided by
//! the time that the pass took. Only counted work ([`Work`]) enters: reads of the volume by tracking and by
//! marches, texels of a picture that a pass reads and writes once each, bytes that are copied or cleared. Of a pass that
//! makes a table, a list or a layer of the picture, it is the texels that it reads or writes at the least. Random numbers,
//! walks through cells, reads of the cache and shading do not enter, so a share below 1 is not all waste. Rates are those
//! of a volume that fits the caches: what a larger one costs in locality counts as the pass's loss.

mod filter_probe;
mod peak_rate;

pub use filter_probe::filter_error;
pub use peak_rate::{PeakRates, peak, peak_rates};

use serde::Serialize;

use crate::gpu::Work;

/// The most that a device does in a second of each kind of work that passes count.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Peak {
    /// Trilinear samples of a volume that fits the caches, taken as in a render, by eight reads.
    pub samples_cached: f64,
    /// Reads of single voxels of the same volume.
    pub reads_cached: f64,
    /// Writes of texels of four 32-bit floats.
    pub writes: f64,
    /// Bytes copied from one buffer to another on the device.
    pub copied_bytes: f64,
}

impl Peak {
    /// The better of two measurements of each kind.
    fn or_better(self, other: Peak) -> Peak {
        Peak {
            samples_cached: self.samples_cached.max(other.samples_cached),
            reads_cached: self.reads_cached.max(other.reads_cached),
            writes: self.writes.max(other.writes),
            copied_bytes: self.copied_bytes.max(other.copied_bytes),
        }
    }

    /// The least time in which the device can do that work: the time of the one kind of it that takes longest by
    /// itself, since the others can go on meanwhile (the roofline model of Williams, Waterman and Patterson, CACM
    /// 52(4), 2009).
    pub fn seconds(&self, work: &Work) -> f64 {
        let kinds = [
            (work.samples, self.samples_cached),
            (work.reads, self.reads_cached),
            (work.writes, self.writes),
            (work.copied_bytes, self.copied_bytes),
        ];
        let seconds = kinds.map(|(count, rate)| count as f64 / rate);
        seconds.into_iter().fold(0.0, f64::max)
    }
}
