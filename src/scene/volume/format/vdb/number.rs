//! The numbers of a grid, and how they lie in the file.

use half::f16;

use super::stream::Stream;
use crate::scene::volume::parsed::Parsed;
use crate::scene::volume::voxel_type::VoxelType;

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Number {
    /// The type after reading.
    pub voxel_type: VoxelType,
    /// Whether numbers in arrays are floats of 16 bits in the file. Those that stand alone are not: backgrounds, and values
    /// of inactive slots.
    has_narrow_arrays: bool,
}

/// What the name of a grid's type ends with if its arrays were saved in 16 bits.
const HALF_FLOAT: &str = "_HalfFloat";
/// The one shape of tree that OpenVDB's own programs use.
const SHAPE: &str = "_5_4_3";

impl Number {
    /// The numbers that are read, for messages.
    pub const NAMES: &str = "float, double, half, int32 or int64";

    /// The number in a grid of this type, such as "Tree_float_5_4_3_HalfFloat"; `None` if it is not a number, or the
    /// tree has another shape.
    pub fn of(grid_type: &str) -> Option<Number> {
        let (voxel_type, can_be_narrow) = match Number::name(grid_type) {
            "half" => (VoxelType::F16, false),
            "float" => (VoxelType::F32, true),
            "double" => (VoxelType::F64, true),
            "int32" => (VoxelType::I32, false),
            "int64" => (VoxelType::I64, false),
            _ => return None,
        };
        Some(Number {
            voxel_type,
            has_narrow_arrays: can_be_narrow && grid_type.ends_with(HALF_FLOAT),
        })
    }

    /// What a tree holds: "float" of "Tree_float_5_4_3_HalfFloat". All of the type's name if the tree has another shape.
    pub fn name(grid_type: &str) -> &str {
        let tree = grid_type.strip_suffix(HALF_FLOAT).unwrap_or(grid_type);
        let name = tree.strip_prefix("Tree_");
        let name = name.and_then(|name| name.strip_suffix(SHAPE));
        name.unwrap_or(grid_type)
    }

    /// Bytes of a number after reading.
    pub fn bytes(self) -> usize {
        self.voxel_type.bytes()
    }

    /// Bytes of a number of an array in the file.
    pub fn bytes_in_arrays(self) -> usize {
        if self.has_narrow_arrays {
            VoxelType::F16.bytes()
        } else {
            self.bytes()
        }
    }

    /// Whether there is nothing, not even a size, in the place of an array without numbers: so OpenVDB writes arrays that
    /// it converts.
    pub fn leaves_out_empty(self) -> bool {
        self.has_narrow_arrays
    }

    /// Reads a number that stands alone.
    pub fn read(self, stream: &mut Stream) -> Parsed<Vec<u8>> {
        stream.bytes(self.bytes() as u64).map(<[u8]>::to_vec)
    }

    /// An array's numbers, from their bytes in the file.
    pub fn array(self, bytes: Vec<u8>) -> Vec<u8> {
        if self.has_narrow_arrays {
            self.widened(&bytes)
        } else {
            bytes
        }
    }

    fn widened(self, halves: &[u8]) -> Vec<u8> {
        let (halves, _) = halves.as_chunks::<2>();
        let numbers = halves.iter().map(|half| f16::from_le_bytes(*half));
        match self.voxel_type {
            VoxelType::F64 => numbers
                .flat_map(|half| half.to_f64().to_le_bytes())
                .collect(),
            _ => numbers
                .flat_map(|half| half.to_f32().to_le_bytes())
                .collect(),
        }
    }

    /// The number with the other sign.
    pub fn negated(self, number: &[u8]) -> Vec<u8> {
        let mut negated = number.to_vec();
        if self.voxel_type.is_float() {
            if let Some(highest) = negated.last_mut() {
                *highest ^= 0x80;
            }
            return negated;
        }
        let mut carry = true;
        for byte in &mut negated {
            (*byte, carry) = (!*byte).overflowing_add(carry.into());
        }
        negated
    }
}
