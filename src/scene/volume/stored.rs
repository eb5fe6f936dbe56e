//! The width in which voxels are kept, and the conversion from the type that a file has.
//!
//! A GPU samples 8 and 16 bits directly, so small integers keep their width, and a rescaling only gives stored values
//! another meaning. Signed ones are shifted by half their range, which flips their top bit. Everything else becomes
//! f32, and so do integers with a negative slope: stored values and values must have the same order.

use bytemuck::{Pod, cast_slice, cast_slice_mut};
use half::f16;

use super::parsed::Parsed;
use super::voxel_type::{Endian, VoxelType};

/// The type of a stored value, in the byte order of this machine.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum StoredType {
    U8,
    U16,
    F32,
}

impl StoredType {
    /// The size of a stored value.
    pub fn bytes(self) -> usize {
        match self {
            StoredType::U8 => 1,
            StoredType::U16 => 2,
            StoredType::F32 => 4,
        }
    }

    /// Number of different values if they are counted one by one; 0 if they are too many.
    pub(super) fn counted(self) -> usize {
        match self {
            StoredType::U8 => u8::COUNTED,
            StoredType::U16 => u16::COUNTED,
            StoredType::F32 => f32::COUNTED,
        }
    }

    /// The stored value that a GPU reads as 1.
    pub fn max(self) -> f32 {
        match self {
            StoredType::U8 => 255.0,
            StoredType::U16 => 65535.0,
            StoredType::F32 => 1.0,
        }
    }
}

/// Stored values in memory, x fastest.
#[derive(Debug, Clone, PartialEq)]
pub enum Voxels {
    U8(Vec<u8>),
    U16(Vec<u16>),
    F32(Vec<f32>),
}

impl Voxels {
    pub(super) fn zeros(stored: StoredType, count: usize) -> Voxels {
        match stored {
            StoredType::U8 => Voxels::U8(vec![0; count]),
            StoredType::U16 => Voxels::U16(vec![0; count]),
            StoredType::F32 => Voxels::F32(vec![0.0; count]),
        }
    }

    pub fn len(&self) -> usize {
        match self {
            Voxels::U8(voxels) => voxels.len(),
            Voxels::U16(voxels) => voxels.len(),
            Voxels::F32(voxels) => voxels.len(),
        }
    }

    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }

    pub fn stored(&self) -> StoredType {
        match self {
            Voxels::U8(_) => StoredType::U8,
            Voxels::U16(_) => StoredType::U16,
            Voxels::F32(_) => StoredType::F32,
        }
    }

    pub(super) fn bytes(&self) -> &[u8] {
        match self {
            Voxels::U8(voxels) => voxels,
            Voxels::U16(voxels) => cast_slice(voxels),
            Voxels::F32(voxels) => cast_slice(voxels),
        }
    }

    pub(super) fn bytes_mut(&mut self) -> &mut [u8] {
        match self {
            Voxels::U8(voxels) => voxels,
            Voxels::U16(voxels) => cast_slice_mut(voxels),
            Voxels::F32(voxels) => cast_slice_mut(voxels),
        }
    }
}

/// A stored value, for code that is the same for all three types.
pub(super) trait Stored: Pod + PartialOrd + Send + Sync + Into<f32> {
    /// Number of different values, if each can be counted; 0 if they are too many.
    const COUNTED: usize;

    /// The value as an index into counts.
    fn index(self) -> usize;

    /// The value, or one less than all others in place of a value that is not finite.
    fn or_lowest(self) -> Self;

    fn collect(values: Vec<Self>) -> Voxels;
}

impl Stored for u8 {
    const COUNTED: usize = 1 << 8;

    fn index(self) -> usize {
        self.into()
    }

    fn or_lowest(self) -> u8 {
        self
    }

    fn collect(values: Vec<u8>) -> Voxels {
        Voxels::U8(values)
    }
}

impl Stored for u16 {
    const COUNTED: usize = 1 << 16;

    fn index(self) -> usize {
        self.into()
    }

    fn or_lowest(self) -> u16 {
        self
    }

    fn collect(values: Vec<u16>) -> Voxels {
        Voxels::U16(values)
    }
}

impl Stored for f32 {
    const COUNTED: usize = 0;

    fn index(self) -> usize {
        0
    }

    fn or_lowest(self) -> f32 {
        if self.is_finite() {
            self
        } else {
            f32::NEG_INFINITY
        }
    }

    fn collect(values: Vec<f32>) -> Voxels {
        Voxels::F32(values)
    }
}

/// The 64-bit integers that are accepted: those for which 32 bits would have been enough. The type is then a habit of
/// the program that wrote the file. A larger one is an identifier or a counter, which f32 would garble.
const FITTING: std::ops::RangeInclusive<i128> = i32::MIN as i128..=u32::MAX as i128;

/// How values in a file are converted to stored values.
#[derive(Debug, Clone, Copy)]
pub(super) struct Conversion {
    pub from: VoxelType,
    pub endian: Endian,
    /// A voxel's value is intercept + slope · the number in the file.
    pub slope: f64,
    pub intercept: f64,
}

impl Conversion {
    /// The conversion for voxels that are stored values already.
    pub fn none(stored: StoredType) -> Conversion {
        Conversion {
            from: match stored {
                StoredType::U8 => VoxelType::U8,
                StoredType::U16 => VoxelType::U16,
                StoredType::F32 => VoxelType::F32,
            },
            endian: Endian::NATIVE,
            slope: 1.0,
            intercept: 0.0,
        }
    }

    pub fn stored(&self) -> StoredType {
        match self.from {
            VoxelType::U8 | VoxelType::I8 if self.slope > 0.0 => StoredType::U8,
            VoxelType::U16 | VoxelType::I16 if self.slope > 0.0 => StoredType::U16,
            _ => StoredType::F32,
        }
    }

    /// The meaning of a stored value: scale and offset.
    pub fn meaning(&self) -> (f64, f64) {
        let shift = match self.from {
            VoxelType::I8 => -128.0,
            VoxelType::I16 => -32768.0,
            _ => 0.0,
        };
        match self.stored() {
            StoredType::F32 => (1.0, 0.0),
            _ => (self.slope, self.intercept + self.slope * shift),
        }
    }

    /// Whether stored values are the file's own bytes.
    pub fn is_none(&self) -> bool {
        let is_native = self.endian == Endian::NATIVE;
        match (self.from, self.stored()) {
            (VoxelType::U8, StoredType::U8) => true,
            (VoxelType::U16, StoredType::U16) => is_native,
            (VoxelType::F32, _) => is_native && !self.rescales(),
            _ => false,
        }
    }

    fn rescales(&self) -> bool {
        (self.slope, self.intercept) != (1.0, 0.0)
    }

    /// Converts one voxel after another. Returns the largest change that rounding to f32 made, or names
    /// the first integer of 64 bits that does not fit 32.
    pub fn convert(&self, bytes: &[u8], stored: &mut [u8]) -> Parsed<f64> {
        let endian = self.endian;
        let mut to = Rescaling::new(self);
        match (self.from, self.stored()) {
            (VoxelType::U8, StoredType::U8) => stored.copy_from_slice(bytes),
            (VoxelType::I8, StoredType::U8) => each(bytes, stored, |[byte]| [byte ^ 0x80]),
            (VoxelType::U16, StoredType::U16) => {
                each(bytes, stored, |bytes| endian.u16(bytes).to_ne_bytes())
            }
            (VoxelType::I16, StoredType::U16) => each(bytes, stored, |bytes| {
                (endian.u16(bytes) ^ 0x8000).to_ne_bytes()
            }),
            (VoxelType::U8, _) => each(bytes, stored, |[byte]| to.rescaled(byte)),
            (VoxelType::I8, _) => each(bytes, stored, |[byte]| to.rescaled(byte as i8)),
            (VoxelType::U16, _) => each(bytes, stored, |bytes| to.rescaled(endian.u16(bytes))),
            (VoxelType::I16, _) => {
                each(bytes, stored, |bytes| to.rescaled(endian.u16(bytes) as i16))
            }
            (VoxelType::U32, _) => each(bytes, stored, |bytes| to.rescaled(endian.u32(bytes))),
            (VoxelType::I32, _) => {
                each(bytes, stored, |bytes| to.rescaled(endian.u32(bytes) as i32))
            }
            (VoxelType::U64, _) => each(bytes, stored, |bytes| {
                to.rescaled_integer(endian.u64(bytes).into())
            }),
            (VoxelType::I64, _) => each(bytes, stored, |bytes| {
                to.rescaled_integer((endian.u64(bytes) as i64).into())
            }),
            (VoxelType::F16, _) => each(bytes, stored, |bytes| {
                to.rescaled(f16::from_bits(endian.u16(bytes)))
            }),
            (VoxelType::F32, _) if self.rescales() => each(bytes, stored, |bytes| {
                to.rescaled(f32::from_bits(endian.u32(bytes)))
            }),
            (VoxelType::F32, _) => each(bytes, stored, |bytes| endian.u32(bytes).to_ne_bytes()),
            (VoxelType::F64, _) => each(bytes, stored, |bytes| {
                to.rescaled(f64::from_bits(endian.u64(bytes)))
            }),
        }
        match to.misfit {
            None => Ok(to.rounding),
            Some(value) => Err(format!(
                "a voxel is {value}, expected values of {} that fit 32 bits, from {} to {}; convert them \
                 to float64 first",
                self.from,
                FITTING.start(),
                FITTING.end()
            )),
        }
    }
}

/// Rescales numbers to f32, one after another.
struct Rescaling {
    slope: f64,
    intercept: f64,
    /// The largest change that rounding has made.
    rounding: f64,
    /// The first integer that does not fit 32 bits.
    misfit: Option<i128>,
}

impl Rescaling {
    fn new(conversion: &Conversion) -> Rescaling {
        Rescaling {
            slope: conversion.slope,
            intercept: conversion.intercept,
            rounding: 0.0,
            misfit: None,
        }
    }

    fn rescaled(&mut self, value: impl Into<f64>) -> [u8; 4] {
        let exact = self.intercept + self.slope * value.into();
        let kept = exact as f32;
        let change = (f64::from(kept) - exact).abs();
        if kept.is_finite() && change > self.rounding {
            self.rounding = change;
        }
        kept.to_ne_bytes()
    }

    /// Of an integer of 64 bits.
    fn rescaled_integer(&mut self, value: i128) -> [u8; 4] {
        if !FITTING.contains(&value) {
            self.misfit.get_or_insert(value);
        }
        self.rescaled(value as f64)
    }
}

/// Converts one number after another, of `N` bytes each, to `M` bytes.
pub(super) fn each<const N: usize, const M: usize>(
    bytes: &[u8],
    stored: &mut [u8],
    mut convert: impl FnMut([u8; N]) -> [u8; M],
) {
    for (stored, bytes) in stored.as_chunks_mut().0.iter_mut().zip(bytes.as_chunks().0) {
        *stored = convert(*bytes);
    }
}
