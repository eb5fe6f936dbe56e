//! Sums over numbers of the types that a volume of DICOM may have.

use crate::scene::volume::voxel_type::VoxelType;

/// Does the same with numbers of each type.
macro_rules! for_type {
    ($voxel_type:expr, $number:ident => $action:expr) => {
        match $voxel_type {
            VoxelType::U8 => for_type!(u8 as $number => $action),
            VoxelType::I8 => for_type!(i8 as $number => $action),
            VoxelType::U16 => for_type!(u16 as $number => $action),
            VoxelType::I16 => for_type!(i16 as $number => $action),
            VoxelType::U32 => for_type!(u32 as $number => $action),
            VoxelType::I32 => for_type!(i32 as $number => $action),
            _ => for_type!(f32 as $number => $action),
        }
    };
    ($primitive:ident as $number:ident => $action:expr) => {{
        type $number = $primitive;
        $action
    }};
}

/// Adds numbers, times a weight, to sums.
pub fn add(numbers: &[u8], voxel_type: VoxelType, weight: f64, sums: &mut [f64]) {
    for_type!(voxel_type, Number => {
        for (sum, bytes) in sums.iter_mut().zip(numbers.as_chunks().0) {
            *sum += weight * f64::from(Number::from_ne_bytes(*bytes));
        }
    });
}

/// Writes numbers; integers are rounded to the nearest.
pub fn write(row: &[f64], voxel_type: VoxelType, bytes: &mut [u8]) {
    let is_real = voxel_type == VoxelType::F32;
    for_type!(voxel_type, Number => {
        for (bytes, value) in bytes.as_chunks_mut().0.iter_mut().zip(row) {
            let value = if is_real { *value } else { value.round() };
            *bytes = (value as Number).to_ne_bytes();
        }
    });
}
