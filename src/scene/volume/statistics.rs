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
        mut empty: Histogram,
        grid: &Grid,
        value: impl Fn(f64) -> f64 + Sync,
    ) -> Result<Histogram> {
        if !self.counts.is_empty() {
            let counts = self.counts.iter().enumerate();
            for (stored, &count) in counts.filter(|(_, count)| **count > 0) {
                empty.add(value(stored as f64), count);
            }
            return Ok(empty);
        }
        let mut last = locked(&self.histogram);
        match &*last {
            Some(known) if known.has_the_bins_of(&empty) => Ok(known.clone()),
            _ => Ok(last.insert(count_floats(empty, grid, value)?).clone()),
        }
    }
}

fn count_floats(
    empty: Histogram,
    grid: &Grid,
    value: impl Fn(f64) -> f64 + Sync,
) -> Result<Histogram> {
    let mut all = empty.clone();
    let mut reader = grid.reader();
    let mut stored: Vec<f32> = Vec::new();
    for piece in grid.pieces(PIECE) {
        stored.resize(piece.voxels(), 0.0);
        reader.read(piece, cast_slice_mut(&mut stored))?;
        let shares = shares(piece, &stored).into_par_iter();
        let counted = shares.map(|(_, values)| {
            let mut histogram = empty.clone();
            values
                .iter()
                .for_each(|&stored| histogram.add(value(stored.into()), 1));
            histogram
        });
        counted
            .collect::<Vec<_>>()
            .iter()
            .for_each(|part| all.add_all(part));
    }
    Ok(all)
}
