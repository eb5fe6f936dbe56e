//! The value of voxels that were never written.

use half::f16;
use serde_json::Value;

use crate::scene::volume::parsed::{Parsed, unexpected};
use crate::scene::volume::voxel_type::{Endian, VoxelType};

/// The bytes of such a voxel.
pub fn fill(value: &Value, voxel_type: VoxelType, endian: Endian) -> Parsed<Vec<u8>> {
    let wrong = || {
        unexpected(
            "fill_value",
            &value.to_string(),
            "a number of the array's type",
        )
    };
    let size = voxel_type.bytes();
    // n5-zarr writes numbers as strings.
    let parsed = value
        .as_str()
        .and_then(|text| serde_json::from_str(text).ok());
    let parsed = parsed.map(Value::Number);
    let value = parsed.as_ref().unwrap_or(value);
    let bits = match value {
        Value::Null => 0,
        Value::Bool(is_set) if !voxel_type.is_float() => u64::from(*is_set),
        Value::String(text) if text.starts_with("0x") => {
            let bits = u64::from_str_radix(&text[2..], 16).ok();
            let fits = |bits: &u64| bits.leading_zeros() as usize >= 64 - 8 * size;
            bits.filter(fits).ok_or_else(wrong)?
        }
        Value::Number(number) if !voxel_type.is_float() => {
            let whole = || number.as_f64().filter(|number| number.fract() == 0.0);
            let number = number
                .as_i128()
                .or_else(|| whole().map(|number| number as i128));
            let fits = |number: &i128| voxel_type.integers().contains(number);
            number.filter(fits).ok_or_else(wrong)? as u64
        }
        Value::Number(_) | Value::String(_) => {
            let number = match value.as_str() {
                None => value.as_f64(),
                Some("NaN") => Some(f64::NAN),
                Some("Infinity") => Some(f64::INFINITY),
                Some("-Infinity") => Some(f64::NEG_INFINITY),
                Some(_) => None,
            };
            let number = number.filter(|_| voxel_type.is_float()).ok_or_else(wrong)?;
            float_bits(number, voxel_type)
        }
        _ => return Err(wrong()),
    };
    let mut bytes = bits.to_le_bytes()[..size].to_vec();
    if endian == Endian::Big {
        bytes.reverse();
    }
    Ok(bytes)
}

/// The bits of a number that is rounded to a floating-point type.
fn float_bits(number: f64, voxel_type: VoxelType) -> u64 {
    match voxel_type {
        VoxelType::F16 => f16::from_f64(number).to_bits().into(),
        VoxelType::F32 => (number as f32).to_bits().into(),
        _ => number.to_bits(),
    }
}
