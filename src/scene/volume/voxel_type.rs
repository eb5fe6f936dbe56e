//! The types that voxels have in files.

use std::fmt;
use std::ops::RangeInclusive;
use std::str::FromStr;

use crate::error::{Error, Result};

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum VoxelType {
    U8,
    I8,
    U16,
    I16,
    U32,
    I32,
    U64,
    I64,
    F16,
    F32,
    F64,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Endian {
    Little,
    Big,
}

impl Endian {
    /// The byte order of this machine.
    pub const NATIVE: Endian = if cfg!(target_endian = "big") {
        Endian::Big
    } else {
        Endian::Little
    };

    pub fn u16(self, bytes: [u8; 2]) -> u16 {
        match self {
            Endian::Little => u16::from_le_bytes(bytes),
            Endian::Big => u16::from_be_bytes(bytes),
        }
    }

    pub fn u32(self, bytes: [u8; 4]) -> u32 {
        match self {
            Endian::Little => u32::from_le_bytes(bytes),
            Endian::Big => u32::from_be_bytes(bytes),
        }
    }

    pub fn u64(self, bytes: [u8; 8]) -> u64 {
        match self {
            Endian::Little => u64::from_le_bytes(bytes),
            Endian::Big => u64::from_be_bytes(bytes),
        }
    }

    /// A whole number of up to 8 bytes.
    pub fn number(self, bytes: &[u8]) -> u64 {
        let join = |number: u64, byte: &u8| number << 8 | u64::from(*byte);
        match self {
            Endian::Little => bytes.iter().rev().fold(0, join),
            Endian::Big => bytes.iter().fold(0, join),
        }
    }
}

impl VoxelType {
    const NAMES: [(VoxelType, &str); 11] = [
        (VoxelType::U8, "uint8"),
        (VoxelType::I8, "int8"),
        (VoxelType::U16, "uint16"),
        (VoxelType::I16, "int16"),
        (VoxelType::U32, "uint32"),
        (VoxelType::I32, "int32"),
        (VoxelType::U64, "uint64"),
        (VoxelType::I64, "int64"),
        (VoxelType::F16, "float16"),
        (VoxelType::F32, "float32"),
        (VoxelType::F64, "float64"),
    ];

    /// The type of an integer with `bits` bits.
    pub fn integer(bits: u32, is_signed: bool) -> Option<VoxelType> {
        Some(match (bits, is_signed) {
            (8, false) => VoxelType::U8,
            (8, true) => VoxelType::I8,
            (16, false) => VoxelType::U16,
            (16, true) => VoxelType::I16,
            (32, false) => VoxelType::U32,
            (32, true) => VoxelType::I32,
            (64, false) => VoxelType::U64,
            (64, true) => VoxelType::I64,
            _ => return None,
        })
    }

    /// The type of a floating-point number with `bits` bits.
    pub fn float(bits: u32) -> Option<VoxelType> {
        match bits {
            16 => Some(VoxelType::F16),
            32 => Some(VoxelType::F32),
            64 => Some(VoxelType::F64),
            _ => None,
        }
    }

    /// Whether it is a floating-point number.
    pub fn is_float(self) -> bool {
        matches!(self, VoxelType::F16 | VoxelType::F32 | VoxelType::F64)
    }

    /// The integers that such a voxel may be; none for a floating-point number.
    pub fn integers(self) -> RangeInclusive<i128> {
        let bits = 8 * self.bytes();
        match self {
            VoxelType::F16 | VoxelType::F32 | VoxelType::F64 => RangeInclusive::new(0, -1),
            VoxelType::U8 | VoxelType::U16 | VoxelType::U32 | VoxelType::U64 => 0..=(1 << bits) - 1,
            _ => -(1 << (bits - 1))..=(1 << (bits - 1)) - 1,
        }
    }

    /// The names that [`numpy`](VoxelType::numpy) knows, for messages.
    pub const NUMPY_NAMES: &str = "b1, u1, i1, u2, i2, u4, i4, u8, i8, f2, f4 or f8";

    /// The type with NumPy's name, such as "<u2".
    pub fn numpy(name: &str) -> Option<(VoxelType, Endian)> {
        let (endian, kind) = match name.split_at_checked(1) {
            Some(("<", kind)) => (Endian::Little, kind),
            Some((">", kind)) => (Endian::Big, kind),
            Some(("|" | "=", kind)) => (Endian::NATIVE, kind),
            _ => (Endian::NATIVE, name),
        };
        let voxel_type = match kind {
            "b1" | "u1" => VoxelType::U8,
            "i1" => VoxelType::I8,
            "u2" => VoxelType::U16,
            "i2" => VoxelType::I16,
            "u4" => VoxelType::U32,
            "i4" => VoxelType::I32,
            "u8" => VoxelType::U64,
            "i8" => VoxelType::I64,
            "f2" => VoxelType::F16,
            "f4" => VoxelType::F32,
            "f8" => VoxelType::F64,
            _ => return None,
        };
        Some((voxel_type, endian))
    }

    /// The size of a voxel in the file.
    pub fn bytes(self) -> usize {
        match self {
            VoxelType::U8 | VoxelType::I8 => 1,
            VoxelType::U16 | VoxelType::I16 | VoxelType::F16 => 2,
            VoxelType::U32 | VoxelType::I32 | VoxelType::F32 => 4,
            VoxelType::U64 | VoxelType::I64 | VoxelType::F64 => 8,
        }
    }
}

impl fmt::Display for VoxelType {
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        f.write_str(VoxelType::NAMES[*self as usize].1)
    }
}

impl FromStr for VoxelType {
    type Err = Error;

    /// The types that voxels without a header may have.
    fn from_str(text: &str) -> Result<VoxelType> {
        let is_wide = |kind: &VoxelType| matches!(kind, VoxelType::U64 | VoxelType::I64);
        let mut known = VoxelType::NAMES.iter().filter(|(kind, _)| !is_wide(kind));
        let found = known.clone().find(|(_, name)| *name == text);
        found.map(|(voxel_type, _)| *voxel_type).ok_or_else(|| {
            let first = known.next().map_or("", |(_, name)| name).to_string();
            let names = known.fold(first, |names, (_, name)| names + ", " + name);
            Error::value(format!("expected one of {names}"))
        })
    }
}

impl FromStr for Endian {
    type Err = Error;

    fn from_str(text: &str) -> Result<Endian> {
        match text {
            "little" => Ok(Endian::Little),
            "big" => Ok(Endian::Big),
            _ => Err(Error::value("expected \"little\" or \"big\"")),
        }
    }
}
