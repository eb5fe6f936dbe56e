//! Tallies: summaries of the values of a volume, such as a histogram, which are built up value by value on several cores.

use bytemuck::cast_slice_mut;
use rayon::prelude::*;

use super::grid::Grid;
use super::scan::shares;
use crate::error::Result;

/// Voxels of a piece of the scan of floats.
const PIECE: usize = 2 << 20;

/// A summary that is built up value by value, on several cores.
pub(super) trait Tally: Clone + Send + Sync {
    fn add(&mut self, value: f64, count: u64);

    /// Adds the results of another core.
    fn add_all(&mut self, other: &Self);
}

/// Adds the meaning of stored integers to an empty tally. `counts` says how often each of them occurs.
pub(super) fn tally_integers<T: Tally>(
    mut empty: T,
    counts: &[u64],
    value: impl Fn(f64) -> f64,
) -> T {
    let counts = counts.iter().enumerate();
    for (stored, &count) in counts.filter(|(_, count)| **count > 0) {
        empty.add(value(stored as f64), count);
    }
    empty
}

/// Adds the meaning of stored floats to an empty tally, in a scan of the voxels.
pub(super) fn tally_floats<T: Tally>(
    empty: T,
    grid: &Grid,
    value: impl Fn(f64) -> f64 + Sync,
) -> Result<T> {
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
