//! What can be said of a volume only once all of its voxels have been seen: the range of values, what
//! stands for those that are not finite, the macrocells' ranges, and how often each value occurs.
//!
//! All of it is found on one walk through the source, and no voxel is kept for it: voxels pass
//! through a buffer. Behind compression, where a header could promise anything, what is allocated grows
//! with the voxels that really arrive.
//!
//! A small compressed file is the exception: its voxels are kept, because whoever opens a volume
//! reads it once more at least, and inflating takes longer than all the rest.

use std::time::Instant;

use bytemuck::cast_slice_mut;
use rayon::prelude::*;

use super::format::Parsed;
use super::grid::Grid;
use super::macrocells::Macrocells;
use super::reading::Reading;
use super::stored::{Stored, StoredType};
use super::{Region, Voxels};

/// Bytes of a piece of the walk. From a compressed file, of which nobody knows how much of it there is,
/// they are fewer.
const PIECE: usize = 8 << 20;
const PIECE_OF_STREAM: usize = 256 << 10;
/// Voxels of a core's share, at least, and cores that count at once, at most: each has counts of its own.
const SHARE: usize = 32 << 10;
const MOST_SHARES: usize = 16;
/// Bytes up to which the voxels of a compressed file stay in memory.
const MOST_KEPT: u64 = 32 << 20;

/// What was found, in stored values.
pub(super) struct Settled {
    pub range: [f32; 2],
    /// Voxels whose value is not finite; the lowest of `range` takes its place.
    pub infinite: u64,
    /// The largest change that storing a value as f32 made.
    pub rounding: f64,
    /// Smallest and largest value of each macrocell, x fastest.
    pub ranges: Vec<[f32; 2]>,
    /// How often each stored value occurs; empty for floats.
    pub counts: Vec<u64>,
    /// The voxels as the source has them, if they are worth their memory.
    pub kept: Option<Voxels>,
}

/// Walks through a grid. Where the volume has its slices in reverse, `grid` does not, but the
/// macrocells are the volume's.
pub(super) fn settle(grid: &Grid, is_mirrored: bool, reading: &Reading) -> Parsed<Settled> {
    match grid.stored() {
        StoredType::U8 => walk::<u8>(grid, is_mirrored, reading),
        StoredType::U16 => walk::<u16>(grid, is_mirrored, reading),
        StoredType::F32 => walk::<f32>(grid, is_mirrored, reading),
    }
}

/// What one core has seen.
struct Tally {
    counts: Vec<u64>,
    infinite: u64,
    /// The least of the finite values beside infinite ones.
    least: f32,
}

fn walk<T: Stored>(grid: &Grid, is_mirrored: bool, reading: &Reading) -> Parsed<Settled> {
    let all = Region::whole(grid.dims()).voxels() as u64;
    let size = grid.conversion.from.bytes() as u64;
    reading.expect(all * size);
    let is_stream = !grid.source.is_random();
    let piece_bytes = if is_stream { PIECE_OF_STREAM } else { PIECE };
    let is_kept = is_stream && all * size_of::<T>() as u64 <= MOST_KEPT;

    let mut reader = grid.reader();
    let mut buffer: Vec<T> = Vec::new();
    let mut kept: Vec<T> = Vec::new();
    let mut macrocells = Macrocells::new(grid.dims(), is_mirrored);
    let mut tallies: Vec<Tally> = Vec::new();
    for piece in grid.pieces(piece_bytes / size_of::<T>()) {
        let began = Instant::now();
        buffer.resize(piece.voxels(), T::zeroed());
        reader.fill(piece, cast_slice_mut(&mut buffer))?;
        reading.spend(began.elapsed());
        reading.advance(piece.voxels() as u64 * size)?;

        let shares = shares(piece, &buffer);
        while tallies.len() < shares.len() {
            tallies.push(Tally::new::<T>());
        }
        let seen = shares.into_par_iter().zip(&mut tallies);
        let parts = seen.map(|((region, values), tally)| {
            tally.add(values);
            macrocells.part(region, values)
        });
        for part in parts.collect::<Vec<_>>() {
            macrocells.add(&part);
        }
        if is_kept {
            kept.extend_from_slice(&buffer);
        }
    }
    let mut settled = Settled {
        range: [0.0; 2],
        infinite: 0,
        rounding: reader.rounding,
        ranges: macrocells.finish(),
        counts: Vec::new(),
        kept: is_kept.then(|| T::collect(kept)),
    };
    let least = tallies
        .iter()
        .map(|tally| tally.least)
        .fold(f32::INFINITY, f32::min);
    settled.fill_gaps(least)?;
    for tally in tallies {
        settled.infinite += tally.infinite;
        match settled.counts.is_empty() {
            true => settled.counts = tally.counts,
            false => {
                for (sum, count) in settled.counts.iter_mut().zip(tally.counts) {
                    *sum += count;
                }
            }
        }
    }
    Ok(settled)
}

/// Parts of a region for all cores, each with its values.
pub(super) fn shares<T>(region: Region, values: &[T]) -> Vec<(Region, &[T])> {
    let cores = rayon::current_num_threads().min(MOST_SHARES);
    let mut rest = values;
    let pieces = region.pieces(values.len().div_ceil(cores).max(SHARE));
    let share = |piece: Region| {
        let (share, later) = rest.split_at(piece.voxels());
        rest = later;
        (piece, share)
    };
    pieces.map(share).collect()
}

impl Tally {
    fn new<T: Stored>() -> Tally {
        Tally {
            counts: vec![0; T::COUNTED],
            infinite: 0,
            least: f32::INFINITY,
        }
    }

    fn add<T: Stored>(&mut self, values: &[T]) {
        if T::COUNTED > 0 {
            for value in values {
                self.counts[value.index()] += 1;
            }
            return;
        }
        let is_finite = |value: &T| Into::<f32>::into(*value).is_finite();
        let finite = values.iter().filter(|value| is_finite(value)).count();
        self.infinite += (values.len() - finite) as u64;
        if finite < values.len() {
            let finite = values.iter().copied().filter(is_finite).map(Into::into);
            self.least = finite.fold(self.least, f32::min);
        }
    }
}

impl Settled {
    /// Finds the range of values, of which `least` is one, and puts its low end where a macrocell has a
    /// value that is not finite.
    fn fill_gaps(&mut self, least: f32) -> Parsed<()> {
        let finite = self
            .ranges
            .iter()
            .map(|range| range[0])
            .filter(|low| low.is_finite());
        let low = finite.fold(least, f32::min);
        let high = self
            .ranges
            .iter()
            .fold(f32::NEG_INFINITY, |high, range| high.max(range[1]));
        if low > high {
            return Err("no voxel has a finite value".into());
        }
        for value in self.ranges.as_flattened_mut() {
            *value = value.max(low);
        }
        self.range = [low, high];
        Ok(())
    }
}
