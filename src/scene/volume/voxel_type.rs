//! The types that voxels have in files.

use std::fmt;
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
    pub const NATIVE: Endian = match cfg!(target_endian = "big") {
        true => Endian::Big,
        false => Endian::Little,
    };
}

impl VoxelType {
    const NAMES: [(VoxelType, &str); 8] = [
        (VoxelType::U8, "uint8"),
        (VoxelType::I8, "int8"),
        (VoxelType::U16, "uint16"),
        (VoxelType::I16, "int16"),
        (VoxelType::U32, "uint32"),
        (VoxelType::I32, "int32"),
        (VoxelType::F32, "float32"),
        (VoxelType::F64, "float64"),
    ];

    /// The size of a voxel in the file.
    pub fn bytes(self) -> usize {
        match self {
            VoxelType::U8 | VoxelType::I8 => 1,
            VoxelType::U16 | VoxelType::I16 => 2,
            VoxelType::U32 | VoxelType::I32 | VoxelType::F32 => 4,
            VoxelType::F64 => 8,
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

    fn from_str(text: &str) -> Result<VoxelType> {
        let found = VoxelType::NAMES.iter().find(|(_, name)| *name == text);
        found.map(|(voxel_type, _)| *voxel_type).ok_or_else(|| {
            let names = VoxelType::NAMES.map(|(_, name)| name).join(", ");
            Error::input(format!("expected one of {names}"))
        })
    }
}

impl FromStr for Endian {
    type Err = Error;

    fn from_str(text: &str) -> Result<Endian> {
        match text {
            "little" => Ok(Endian::Little),
            "big" => Ok(Endian::Big),
            _ => Err(Error::input("expected \"little\" or \"big\"")),
        }
    }
}
