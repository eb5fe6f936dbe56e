//! The statistics of a volume's stored values, which are kept once all of them have been seen.

use std::sync::Mutex;

use bytemuck::cast_slice_mut;
use rayon::prelude::*;

use super::grid::Grid;
use super::histogram::Histogram;
use super::settle::shares;
use crate::error::Result;
use crate::locked::locked;

/// Voxels of a piece of the walk through floats.
const PIECE: usize = 2 << 20;

#[derive(Debug)]
pub(super) struct Statistics {
    /// Smallest and largest value of each macrocell, x fastest.
    pub macrocell_ranges: Vec<[f32; 2]>,
    /// How often each value occurs; empty for floats.
    pub counts: Vec<u64>,
    /// The last histogram of floats, for which the voxels were read again.
    histogram: Mutex<Option<Histogram>>,
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

    /// Adds the meaning of all stored values to an empty tally: those of integers, which have been counted, or of floats in a
    /// walk through the voxels.
    pub fn count<T: Tally>(
        &self,
        mut empty: T,
        grid: &Grid,
        value: impl Fn(f64) -> f64 + Sync,
    ) -> Result<T> {
        if self.counts.is_empty() {
            return count_floats(empty, grid, value);
        }
        let counts = self.counts.iter().enumerate();
        for (stored, &count) in counts.filter(|(_, count)| **count > 0) {
            empty.add(value(stored as f64), count);
        }
        Ok(empty)
    }
}

/// What is found out of values one after another, on several cores.
pub(super) trait Tally: Clone + Send + Sync {
    fn add(&mut self, value: f64, count: u64);

    /// Adds the results of another core.
    fn add_all(&mut self, other: &Self);
}

fn count_floats<T: Tally>(empty: T, grid: &Grid, value: impl Fn(f64) -> f64 + Sync) -> Result<T> {
    let mut all = empty.clone();
    let mut reader = grid.reader();
    let mut stored: Vec<f32> = Vec::new();
    for piece in grid.pieces(PIECE) {
        stored.resize(piece.voxels(), 0.0);
        reader.read(piece, cast_slice_mut(&mut stored))?;
        let shares = shares(piece, &stored).into_par_iter();
        let counted = shares.map(|(_, values)| {
            let mut tally = empty.clone();
            values
                .iter()
                .for_each(|&stored| tally.add(value(stored.into()), 1));
            tally
        });
        counted
            .collect::<Vec<_>>()
            .iter()
            .for_each(|part| all.add_all(part));
    }
    Ok(all)
}
