//! The numbers of a grid, and how they lie in the file.

use exr::prelude::f16;

use crate::scene::volume::voxel_type::VoxelType;

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Number {
    voxel_type: VoxelType,
    /// Whether numbers that stand alone (backgrounds, values of inactive slots) have 16 bits.
    is_half_alone: bool,
    /// Whether numbers in arrays have 16 bits.
    is_half_in_arrays: bool,
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
        let tree = grid_type.strip_suffix(HALF_FLOAT);
        let is_saved_as_half = tree.is_some();
        let (voxel_type, is_half) = match Number::name(tree.unwrap_or(grid_type)) {
            "float" => (VoxelType::F32, false),
            "double" => (VoxelType::F64, false),
            "half" => (VoxelType::F32, true),
            "int32" => (VoxelType::I32, false),
            "int64" => (VoxelType::I64, false),
            _ => return None,
        };
        let mut number = Number {
            voxel_type,
            is_half_alone: is_half,
            is_half_in_arrays: is_half,
        };
        number.is_half_in_arrays |= is_saved_as_half && number.is_real();
        Some(number)
    }

    /// What a tree holds: "float" of "Tree_float_5_4_3". All of the type's name if the tree has another shape.
    pub fn name(grid_type: &str) -> &str {
        let inner = grid_type.strip_prefix("Tree_");
        let inner = inner.and_then(|inner| inner.strip_suffix(SHAPE));
        inner.unwrap_or(grid_type)
    }

    /// The type after reading.
    pub fn voxel_type(self) -> VoxelType {
        self.voxel_type
    }

    /// Bytes of a number after reading.
    pub fn bytes(self) -> usize {
        self.voxel_type.bytes()
    }

    /// Whether there is nothing, not even a size, in the place of an array without numbers.
    pub fn leaves_out_empty(self) -> bool {
        self.is_half_in_arrays
    }

    /// Bytes of a number that stands alone in the file.
    pub fn bytes_alone(self) -> usize {
        if self.is_half_alone { 2 } else { self.bytes() }
    }

    /// Bytes of a number of an array in the file.
    pub fn bytes_in_arrays(self) -> usize {
        if self.is_half_in_arrays {
            2
        } else {
            self.bytes()
        }
    }

    /// A number that stands alone, from its bytes in the file.
    pub fn alone(self, bytes: &[u8]) -> Vec<u8> {
        match self.is_half_alone {
            true => self.widened(bytes),
            false => bytes.to_vec(),
        }
    }

    /// An array's numbers, from their bytes in the file.
    pub fn array(self, bytes: Vec<u8>) -> Vec<u8> {
        match self.is_half_in_arrays {
            true => self.widened(&bytes),
            false => bytes,
        }
    }

    fn widened(self, halves: &[u8]) -> Vec<u8> {
        let halves = halves.chunks_exact(2);
        let numbers = halves.map(|half| f16::from_le_bytes([half[0], half[1]]));
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
        if self.is_real() {
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

    fn is_real(self) -> bool {
        matches!(self.voxel_type, VoxelType::F32 | VoxelType::F64)
    }
}
