//! The statistics of a volume's stored values, which are kept once all of them have been seen.

use std::sync::Mutex;

use super::grid::Grid;
use super::histogram::Histogram;
use super::tally::{Tally, tally_floats, tally_integers};
use crate::error::Result;
use crate::locked::locked;

#[derive(Debug)]
pub(super) struct Statistics {
    /// Smallest and largest value of each macrocell, x fastest.
    pub macrocell_ranges: Vec<[f32; 2]>,
    /// How often each value occurs; empty for floats.
    pub counts: Vec<u64>,
    /// The last histogram of floats, for which the voxels were read again.
    histogram: Mutex<Option<Histogram>>,
    /// The histogram of the range in which the data lie, once it was asked for: to find outliers, voxels are read again.
    pub of_data: Mutex<Option<Histogram>>,
}

impl Statistics {
    /// `histogram` is a known histogram of floats.
    pub fn new(
        macrocell_ranges: Vec<[f32; 2]>,
        counts: Vec<u64>,
        histogram: Option<Histogram>,
    ) -> Statistics {
        Statistics {
            macrocell_ranges,
            counts,
            histogram: Mutex::new(histogram),
            of_data: Mutex::default(),
        }
    }

    /// The last histogram of floats.
    pub fn histogram(&self) -> Option<Histogram> {
        locked(&self.histogram).clone()
    }

    /// Fills an empty histogram over the meaning of stored values. Integers have been counted; floats are counted
    /// now, unless the same bins were asked for before.
    pub fn fill(
        &self,
        empty: Histogram,
        grid: &Grid,
        value: impl Fn(f64) -> f64 + Sync,
    ) -> Result<Histogram> {
        if !self.counts.is_empty() {
            return self.count(empty, grid, value);
        }
        let mut last = locked(&self.histogram);
        match &*last {
            Some(known) if known.has_the_bins_of(&empty) => Ok(known.clone()),
            _ => Ok(last.insert(self.count(empty, grid, value)?).clone()),
        }
    }

    /// Adds the meaning of all stored values to an empty tally: those of integers, which have been counted, or of
    /// floats in a scan of the voxels.
    pub fn count<T: Tally>(
        &self,
        empty: T,
        grid: &Grid,
        value: impl Fn(f64) -> f64 + Sync,
    ) -> Result<T> {
        if self.counts.is_empty() {
            tally_floats(empty, grid, value)
        } else {
            Ok(tally_integers(empty, &self.counts, value))
        }
    }
}
