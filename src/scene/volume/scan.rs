//! The properties of a volume that depend on all of its voxels: the range of values, the value in place of those that
//! are not finite, the macrocells' ranges, and how often each value occurs.
//!
//! All of it is found in one scan of the source, and no voxel is kept for it: voxels pass through a buffer.
//! Behind compression, where a header could promise anything, allocations grow with the voxels that really arrive.
//!
//! A small compressed file is the exception: its voxels are kept, because an opened volume is read at least once
//! more, and inflating takes longer than all the rest.

use std::time::Instant;

use bytemuck::cast_slice_mut;
use rayon::prelude::*;

use super::grid::Grid;
use super::macrocells::Macrocells;
use super::parsed::Parsed;
use super::reading::Reading;
use super::region::Region;
use super::source::Access;
use super::stored::{Stored, StoredType, Voxels};

/// Bytes of a piece of the scan.
const PIECE: usize = 8 << 20;
/// Bytes of a piece of a compressed file, whose header may promise more than the file holds.
const PIECE_OF_STREAM: usize = 256 << 10;
/// The least number of voxels that is worth a core's attention.
const SHARE: usize = 32 << 10;
/// The most cores that work on a piece at once, since each has counts of its own.
const MOST_SHARES: usize = 16;
/// Bytes up to which the voxels of a compressed file stay in memory.
const MOST_KEPT: u64 = 32 << 20;

/// The results of the scan, in terms of stored values.
#[derive(Debug)]
pub(super) struct Scan {
    pub extremes: Extremes,
    /// Smallest and largest value of each macrocell, x fastest.
    pub ranges: Vec<[f32; 2]>,
    /// How often each stored value occurs; empty for floats.
    pub counts: Vec<u64>,
    /// The voxels as the source has them, if they are worth their memory.
    pub kept: Option<Voxels>,
}

/// The range of the stored values, and what conversion to float32 does to them.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Extremes {
    pub range: [f32; 2],
    /// Voxels whose value is not finite; the lowest of `range` takes its place.
    pub infinite: u64,
    /// The largest change by storing a value as f32.
    pub rounding: f64,
}

/// Scans all voxels of `grid` in the source's order. If the volume reverses the slices (`is_mirrored`), macrocells are
/// nevertheless numbered as in the volume.
pub(super) fn scan(grid: &Grid, is_mirrored: bool, reading: &Reading) -> Parsed<Scan> {
    match grid.stored() {
        StoredType::U8 => scan_as::<u8>(grid, is_mirrored, reading),
        StoredType::U16 => scan_as::<u16>(grid, is_mirrored, reading),
        StoredType::F32 => scan_as::<f32>(grid, is_mirrored, reading),
    }
}

/// The results of one core for its shares.
struct PartialResults {
    counts: Vec<u64>,
    infinite: u64,
    /// Smallest finite value in shares that also hold non-finite values; +∞ if there are none.
    least: f32,
}

fn scan_as<T: Stored>(grid: &Grid, is_mirrored: bool, reading: &Reading) -> Parsed<Scan> {
    let all = Region::whole(grid.dims()).voxels() as u64;
    let size = grid.conversion.from.bytes() as u64;
    reading.expect(all * size);
    let is_stream = grid.source.access() == Access::Sequential;
    let piece_bytes = if is_stream { PIECE_OF_STREAM } else { PIECE };
    let is_kept = is_stream && all * size_of::<T>() as u64 <= MOST_KEPT;

    let mut reader = grid.reader();
    let mut buffer: Vec<T> = Vec::new();
    let mut kept: Vec<T> = Vec::new();
    let mut macrocells = Macrocells::new(grid.dims(), is_mirrored);
    let mut partials: Vec<PartialResults> = Vec::new();
    for piece in grid.pieces(piece_bytes / size_of::<T>()) {
        let began = Instant::now();
        buffer.resize(piece.voxels(), T::zeroed());
        reader.fill(piece, cast_slice_mut(&mut buffer))?;
        reading.spend(began.elapsed());
        reading.advance(piece.voxels() as u64 * size)?;
        add_region(piece, &buffer, &mut macrocells, &mut partials);
        if is_kept {
            kept.extend_from_slice(&buffer);
        }
    }
    let joined = partials.into_iter().reduce(PartialResults::joined);
    let PartialResults {
        counts,
        infinite,
        least,
    } = joined.unwrap_or_else(PartialResults::new::<T>);
    let mut ranges = macrocells.finish();
    Ok(Scan {
        extremes: Extremes {
            range: fill_gaps(&mut ranges, least)?,
            infinite,
            rounding: reader.rounding,
        },
        ranges,
        counts,
        kept: is_kept.then(|| T::collect(kept)),
    })
}

/// Adds the values of a region with all cores, each of which has a share of its own.
fn add_region<T: Stored>(
    region: Region,
    values: &[T],
    macrocells: &mut Macrocells,
    partials: &mut Vec<PartialResults>,
) {
    let shares = shares(region, values);
    while partials.len() < shares.len() {
        partials.push(PartialResults::new::<T>());
    }
    let added = shares.into_par_iter().zip(partials);
    let parts = added.map(|((region, values), partial)| {
        partial.add(values);
        macrocells.part(region, values)
    });
    for part in parts.collect::<Vec<_>>() {
        macrocells.add(&part);
    }
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

impl PartialResults {
    fn new<T: Stored>() -> PartialResults {
        PartialResults {
            counts: vec![0; T::COUNTED],
            infinite: 0,
            least: f32::INFINITY,
        }
    }

    fn add<T: Stored>(&mut self, values: &[T]) {
        match T::COUNTED {
            0 => self.count_infinite(values),
            _ => self.count(values),
        }
    }

    /// Counts eight values at a time. Where a value occurs again and again, as in empty space, counting one by one
    /// would make each count wait for the one before.
    fn count<T: Stored>(&mut self, values: &[T]) {
        const RUN: usize = 8;
        let (runs, rest) = values.as_chunks::<RUN>();
        for run in runs {
            if *run == [run[0]; RUN] {
                self.counts[run[0].index()] += RUN as u64;
            } else {
                run.iter().for_each(|value| self.counts[value.index()] += 1);
            }
        }
        rest.iter()
            .for_each(|value| self.counts[value.index()] += 1);
    }

    fn count_infinite<T: Stored>(&mut self, values: &[T]) {
        let is_finite = |value: &T| Into::<f32>::into(*value).is_finite();
        let finite = values.iter().filter(|value| is_finite(value)).count();
        self.infinite += (values.len() - finite) as u64;
        if finite < values.len() {
            let finite = values.iter().copied().filter(is_finite).map(Into::into);
            self.least = finite.fold(self.least, f32::min);
        }
    }

    fn joined(mut self, other: PartialResults) -> PartialResults {
        for (sum, count) in self.counts.iter_mut().zip(other.counts) {
            *sum += count;
        }
        self.infinite += other.infinite;
        self.least = self.least.min(other.least);
        self
    }
}

/// The range of all values, of which `least` is one. Its low end replaces values that are not finite in the
/// macrocells' ranges.
fn fill_gaps(ranges: &mut [[f32; 2]], least: f32) -> Parsed<[f32; 2]> {
    let lows = ranges.iter().map(|range| range[0]);
    let low = lows.filter(|low| low.is_finite()).fold(least, f32::min);
    let highs = ranges.iter().map(|range| range[1]);
    let high = highs.fold(f32::NEG_INFINITY, f32::max);
    if low > high {
        return Err("no voxel has a finite value within the range of 32-bit floats".into());
    }
    for value in ranges.as_flattened_mut() {
        *value = value.max(low);
    }
    Ok([low, high])
}
