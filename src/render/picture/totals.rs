//! Counts of the work so far.

use std::time::Instant;

use super::bundle::{Bundle, BundleUnderWay};

/// `samples`, `units` and `seen_since` are those of the current picture; counts of work include the pictures before it.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct Totals {
    /// Index of the picture's first sample, which is not 0 in a shard of a picture.
    pub first_sample: u32,
    /// Samples in every pixel.
    pub samples: u32,
    /// Units whose spread gives the standard error; `published` has a single one, which grows.
    pub units: u32,
    /// When this process had the first unit, if it has any.
    pub seen_since: Option<Instant>,
    /// Camera paths of units that have ended.
    pub paths: u64,
    /// Reads of the volume by tracking in these units.
    pub lookups: u64,
    /// Those of `paths` and `lookups` that are of earlier pictures.
    pub paths_before: u64,
    pub lookups_before: u64,
}

impl Totals {
    /// Counts a bundle that has ended in a picture of so many pixels.
    pub fn count(&mut self, ended: &BundleUnderWay, pixels: u32) {
        let Bundle { samples, units, .. } = ended.bundle;
        let samples = samples * units;
        self.samples += samples;
        self.units += units;
        self.seen_since.get_or_insert_with(Instant::now);
        self.paths += u64::from(samples) * u64::from(pixels);
        self.lookups += ended.lookups;
    }
}
