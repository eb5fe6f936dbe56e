//! From a header to a [`Volume`]: reads the kept voxels, converts them, and settles what they mean.
//!
//! Voxels pass through a buffer that stays in the processor's cache, which makes one conversion serve
//! all types, byte orders, crops and compressions. A plain file is read by all cores at once: most of
//! that time goes to the system, which clears each page of new memory. Nothing is allocated for voxels
//! that the file cannot hold; behind compression, where a header could promise anything, memory grows
//! with the voxels that really arrive.

use std::path::Path;
use std::sync::OnceLock;
use std::sync::atomic::{AtomicU64, Ordering};
use std::time::Instant;

use bytemuck::Zeroable;
use bytemuck::allocation::try_zeroed_vec;
use rayon::prelude::*;

use super::header::{Header, Parsed};
use super::orientation::{Axes, Orientation};
use super::reading::Reading;
use super::region::Region;
use super::source::Source;
use super::{Endian, Volume, VolumeOverrides, VoxelType, Voxels};
use crate::error::{Error, Result};

/// Bytes read at a time.
const CHUNK: usize = 256 << 10;
/// Bytes of a share of the work, at least where slices are small enough.
const SHARE: usize = 4 << 20;

pub(super) fn decode(
    path: &Path,
    header: &Header,
    overrides: &VolumeOverrides,
    reading: &Reading,
) -> Result<Volume> {
    let named = |fault| Error::input(format!("{}: {fault}", path.display()));
    header.bytes().map_err(named)?;
    let region = Region::new(header.dims, overrides.crop).map_err(named)?;
    let spacing = overrides.spacing.unwrap_or(header.spacing);
    check_spacing(spacing, region.dims).map_err(named)?;
    check_rescale(header).map_err(named)?;

    let in_data = |fault: String| match header.data.path == path {
        true => named(fault),
        false => named(format!(
            "its data file {}: {fault}",
            header.data.path.display()
        )),
    };
    let file = Kept {
        header,
        region,
        reading,
    };
    let decoded = read(file).map_err(|failure| match failure {
        Failure::Fault(fault) => in_data(fault),
        Failure::Memory(bytes) => Error::Memory(format!(
            "{}: no memory for {bytes} bytes of voxels; load less of it with `crop`",
            path.display()
        )),
    })?;

    let mut volume = Volume {
        dims: region.dims,
        spacing,
        voxels: decoded.voxels,
        scale: decoded.scale,
        offset: decoded.offset,
        range: [0.0; 2],
        axes: None,
        voxel_type: header.voxel_type,
        notes: Vec::new(),
        macrocell_ranges: OnceLock::new(),
    };
    if decoded.rounding > 0.0 {
        volume.notes.push(format!(
            "{} values are kept as float32, which changes some by up to {:.1e}",
            header.voxel_type, decoded.rounding
        ));
    }
    volume.settle_values().map_err(named)?;
    volume.settle_axes(overrides.axes.map_or(header.orientation, Orientation::from));
    Ok(volume)
}

pub(super) fn from_values(dims: [u32; 3], spacing: [f64; 3], voxels: Voxels) -> Result<Volume> {
    check_spacing(spacing, dims).map_err(Error::Input)?;
    let expected = dims.iter().map(|size| u128::from(*size)).product::<u128>();
    if expected == 0 || voxels.len() as u128 != expected {
        return Err(Error::input(format!(
            "{} values were given, expected {expected} for {dims:?} voxels, at least one",
            voxels.len()
        )));
    }
    let voxel_type = match voxels {
        Voxels::U8(_) => VoxelType::U8,
        Voxels::U16(_) => VoxelType::U16,
        Voxels::F32(_) => VoxelType::F32,
    };
    let mut volume = Volume {
        dims,
        spacing,
        voxels,
        scale: 1.0,
        offset: 0.0,
        range: [0.0; 2],
        axes: None,
        voxel_type,
        notes: Vec::new(),
        macrocell_ranges: OnceLock::new(),
    };
    volume.settle_values().map_err(Error::Input)?;
    Ok(volume)
}

/// Lengths must also survive the GPU's 32 bits.
fn check_spacing(spacing: [f64; 3], dims: [u32; 3]) -> Parsed<()> {
    for (axis, (size, count)) in ["x", "y", "z"].iter().zip(spacing.into_iter().zip(dims)) {
        let extent = (size * f64::from(count)) as f32;
        if size <= 0.0 || !(size as f32).is_normal() || !extent.is_finite() {
            return Err(format!(
                "the voxel size along {axis} is {size}, expected a finite length above 0; give \
                 `spacing`"
            ));
        }
    }
    Ok(())
}

fn check_rescale(header: &Header) -> Parsed<()> {
    let (slope, intercept) = (header.slope, header.intercept);
    if (slope as f32).is_normal() && (intercept as f32).is_finite() {
        return Ok(());
    }
    Err(format!(
        "values are rescaled with slope {slope} and intercept {intercept}, expected finite numbers \
         and a slope that is not 0"
    ))
}

enum Failure {
    Fault(String),
    /// The bytes that could not be had.
    Memory(usize),
}

/// The part of a file's voxels that is wanted.
#[derive(Clone, Copy)]
struct Kept<'a> {
    header: &'a Header,
    region: Region,
    reading: &'a Reading,
}

struct Decoded {
    voxels: Voxels,
    scale: f64,
    offset: f64,
    /// The largest change that storing a value as f32 made.
    rounding: f64,
}

/// Small integers keep their width, and a rescaling only gives them another meaning; unless it turns
/// their order around, which stored values must share with values.
fn read(file: Kept) -> std::result::Result<Decoded, Failure> {
    let header = file.header;
    let (slope, intercept) = (header.slope, header.intercept);
    let bits16 = |bytes| match header.endian {
        Endian::Little => u16::from_le_bytes(bytes),
        Endian::Big => u16::from_be_bytes(bytes),
    };
    let bits32 = |bytes| match header.endian {
        Endian::Little => u32::from_le_bytes(bytes),
        Endian::Big => u32::from_be_bytes(bytes),
    };
    let bits64 = |bytes| match header.endian {
        Endian::Little => u64::from_le_bytes(bytes),
        Endian::Big => u64::from_be_bytes(bytes),
    };
    let stored = |voxels, shift| {
        Ok(Decoded {
            voxels,
            scale: slope,
            offset: intercept + slope * shift,
            rounding: 0.0,
        })
    };
    // A signed integer with its top bit flipped is that integer plus half the range.
    if slope > 0.0 {
        match header.voxel_type {
            VoxelType::U8 => {
                return stored(Voxels::U8(collect(file, |[byte]| byte)?), 0.0);
            }
            VoxelType::I8 => {
                let voxels = collect(file, |[byte]| byte ^ 0x80)?;
                return stored(Voxels::U8(voxels), -128.0);
            }
            VoxelType::U16 => {
                return stored(Voxels::U16(collect(file, bits16)?), 0.0);
            }
            VoxelType::I16 => {
                let voxels = collect(file, |bytes| bits16(bytes) ^ 0x8000)?;
                return stored(Voxels::U16(voxels), -32768.0);
            }
            _ => {}
        }
    }
    // Of a number that is not negative, the bits have the order of the number.
    let rounding = AtomicU64::new(0);
    let rescaled = |value: f64| {
        let exact = intercept + slope * value;
        let kept = exact as f32;
        let change = (f64::from(kept) - exact).abs().to_bits();
        if kept.is_finite() && change > rounding.load(Ordering::Relaxed) {
            rounding.fetch_max(change, Ordering::Relaxed);
        }
        kept
    };
    let float = |bytes| f32::from_bits(bits32(bytes));
    let voxels = match header.voxel_type {
        VoxelType::U8 => collect(file, |[byte]| rescaled(byte.into()))?,
        VoxelType::I8 => collect(file, |[byte]| rescaled((byte as i8).into()))?,
        VoxelType::U16 => collect(file, |bytes| rescaled(bits16(bytes).into()))?,
        VoxelType::I16 => collect(file, |bytes| rescaled((bits16(bytes) as i16).into()))?,
        VoxelType::U32 => collect(file, |bytes| rescaled(bits32(bytes).into()))?,
        VoxelType::I32 => collect(file, |bytes| rescaled((bits32(bytes) as i32).into()))?,
        VoxelType::F32 if (slope, intercept) == (1.0, 0.0) => collect(file, float)?,
        VoxelType::F32 => collect(file, |bytes| rescaled(float(bytes).into()))?,
        VoxelType::F64 => collect(file, |bytes| rescaled(f64::from_bits(bits64(bytes))))?,
    };
    Ok(Decoded {
        voxels: Voxels::F32(voxels),
        scale: 1.0,
        offset: 0.0,
        rounding: f64::from_bits(rounding.into_inner()),
    })
}

/// The kept voxels, each converted from its N bytes.
fn collect<T: Zeroable + Send, const N: usize>(
    file: Kept,
    convert: impl Fn([u8; N]) -> T + Sync,
) -> std::result::Result<Vec<T>, Failure> {
    let source = Source::open(file.header, file.reading).map_err(Failure::Fault)?;
    let bytes = file.region.voxels() as u64 * N as u64;
    file.reading.expect(bytes);
    match source.length_is_certain() {
        true => collect_in_shares(file, convert),
        false => collect_as_it_comes(source, file, convert),
    }
}

/// Each share of the slices is read through a reader of its own.
fn collect_in_shares<T: Zeroable + Send, const N: usize>(
    file: Kept,
    convert: impl Fn([u8; N]) -> T + Sync,
) -> std::result::Result<Vec<T>, Failure> {
    let began = Instant::now();
    let Region { dims, .. } = file.region;
    let total = file.region.voxels();
    let slice = dims[0] as usize * dims[1] as usize;
    let slices = (SHARE / N / slice).max(1);
    let mut voxels = try_zeroed_vec(total).map_err(|()| Failure::Memory(total * size_of::<T>()))?;
    let shares = voxels.par_chunks_mut(slices * slice).enumerate();
    let read = shares.try_for_each(|(n, share)| {
        let mut source = Source::open(file.header, file.reading)?;
        let mut chunk = vec![0; CHUNK.min(share.len() * N)];
        let mut done = 0;
        let slab = file.region.slab(n * slices..(n + 1) * slices);
        for (start, count) in slab.pieces(CHUNK / N) {
            let bytes = &mut chunk[..count * N];
            source.read(start * N as u64, bytes)?;
            for (voxel, bytes) in share[done..].iter_mut().zip(bytes.as_chunks().0) {
                *voxel = convert(*bytes);
            }
            done += count;
        }
        Ok(())
    });
    file.reading.spend(began.elapsed());
    read.map(|()| voxels).map_err(Failure::Fault)
}

/// One after another, into memory that grows.
fn collect_as_it_comes<T, const N: usize>(
    mut source: Source,
    file: Kept,
    convert: impl Fn([u8; N]) -> T,
) -> std::result::Result<Vec<T>, Failure> {
    let total = file.region.voxels();
    let mut chunk = vec![0; CHUNK.min(total * N)];
    let mut voxels: Vec<T> = Vec::new();
    for (start, count) in file.region.pieces(CHUNK / N) {
        let began = Instant::now();
        let bytes = &mut chunk[..count * N];
        let read = source.read(start * N as u64, bytes);
        read.map_err(Failure::Fault)?;
        file.reading.spend(began.elapsed());
        if voxels.capacity() - voxels.len() < count {
            let growth = voxels.len().max(count);
            voxels
                .try_reserve_exact(growth.min(total - voxels.len()))
                .map_err(|_| Failure::Memory(total * size_of::<T>()))?;
        }
        voxels.extend(bytes.as_chunks().0.iter().map(|bytes| convert(*bytes)));
    }
    source.finish().map_err(Failure::Fault)?;
    Ok(voxels)
}

impl Volume {
    /// Finds the range of values, and replaces those that are none.
    fn settle_values(&mut self) -> Parsed<()> {
        let [low, high] = match &mut self.voxels {
            Voxels::U8(voxels) => extremes(voxels, [u8::MAX, u8::MIN], |_| true),
            Voxels::U16(voxels) => extremes(voxels, [u16::MAX, u16::MIN], |_| true),
            Voxels::F32(voxels) => {
                let none = [f32::INFINITY, f32::NEG_INFINITY];
                let [low, high] = extremes(voxels, none, f32::is_finite);
                if low > high {
                    return Err("no voxel has a finite value".into());
                }
                let infinite = voxels.par_iter_mut().filter(|value| !value.is_finite());
                let replaced = infinite.map(|voxel| *voxel = low as f32).count();
                if replaced > 0 {
                    self.notes.push(format!(
                        "{replaced} voxels are not finite float32 numbers and became the smallest \
                         value, {low}"
                    ));
                }
                [low, high]
            }
        };
        self.range = [low, high].map(|stored| self.offset + self.scale * stored);
        match self.range.iter().all(|value| (*value as f32).is_finite()) {
            true => Ok(()),
            false => Err(format!(
                "values reach from {:e} to {:e}, expected them within float32",
                self.range[0], self.range[1]
            )),
        }
    }

    /// Left-handed axes would show the mirror image: the slowest one is reversed.
    fn settle_axes(&mut self, orientation: Orientation) {
        self.axes = orientation.axes;
        if !orientation.left_handed {
            return;
        }
        let slice = self.dims[0] as usize * self.dims[1] as usize;
        match &mut self.voxels {
            Voxels::U8(voxels) => reverse_slices(voxels, slice),
            Voxels::U16(voxels) => reverse_slices(voxels, slice),
            Voxels::F32(voxels) => reverse_slices(voxels, slice),
        }
        let mut letters = String::new();
        if let Some(Axes([i, j, k])) = self.axes {
            let reversed = Axes([i, j, k.opposite()]);
            letters = format!(": {} became {reversed}", Axes([i, j, k]));
            self.axes = Some(reversed);
        }
        self.notes.push(format!(
            "the file's axes are left-handed, so its slowest axis is reversed{letters}"
        ));
    }
}

/// The smallest and largest of the values that count; `none` if there is none. Columns of a short row
/// are folded first, which a processor does many at a time.
fn extremes<T: Copy + PartialOrd + Send + Sync + Into<f64>>(
    values: &[T],
    none: [T; 2],
    counts: impl Fn(T) -> bool + Sync,
) -> [f64; 2] {
    const COLUMNS: usize = 64;
    let lesser = |a: T, b: T| if b < a { b } else { a };
    let greater = |a: T, b: T| if b > a { b } else { a };
    let of_part = |part: &[T]| {
        let (mut low, mut high) = ([none[0]; COLUMNS], [none[1]; COLUMNS]);
        for row in part.chunks(COLUMNS) {
            for ((low, high), &value) in low.iter_mut().zip(&mut high).zip(row) {
                let [a, b] = if counts(value) { [value; 2] } else { none };
                (*low, *high) = (lesser(*low, a), greater(*high, b));
            }
        }
        let low = low.into_iter().fold(none[0], lesser);
        [low, high.into_iter().fold(none[1], greater)]
    };
    let wider = |a: [T; 2], b: [T; 2]| [lesser(a[0], b[0]), greater(a[1], b[1])];
    let parts = values.par_chunks(CHUNK).map(of_part);
    parts.reduce(|| none, wider).map(Into::into)
}

fn reverse_slices<T>(voxels: &mut [T], slice: usize) {
    let count = voxels.len() / slice;
    for k in 0..count / 2 {
        let (front, back) = voxels.split_at_mut((count - 1 - k) * slice);
        front[k * slice..][..slice].swap_with_slice(&mut back[..slice]);
    }
}
