//! NumPy arrays (`.npy`): <https://numpy.org/doc/stable/reference/generated/numpy.lib.format.html>.
//!
//! An array's fastest index is x, as the voxels lie in the file: C order is [z, y, x], Fortran order
//! is [x, y, z]. The header is a Python dictionary; only its three known keys are looked for.

use std::path::Path;

use super::header::{Header, first_bytes};
use super::text::TEXT_LIMIT;
use crate::scene::volume::parsed::{Parsed, unexpected};
use crate::scene::volume::voxel_type::{Endian, VoxelType};

pub fn read(path: &Path) -> Parsed<Header> {
    let bytes = first_bytes(path, TEXT_LIMIT)?;
    let (text, end) = dictionary(&bytes)?;
    let (voxel_type, endian) = element(&text)?;
    let (dims, note) = dims(&text)?;
    let mut header = Header::of_plain_file(path, end as u64, dims, voxel_type, endian)?;
    header.notes.extend(note);
    Ok(header)
}

/// The header's text and the offset of the data after it.
fn dictionary(bytes: &[u8]) -> Parsed<(String, usize)> {
    let (begin, length) = match bytes {
        [0x93, b'N', b'U', b'M', b'P', b'Y', 1, _, a, b, ..] => {
            (10, u32::from_le_bytes([*a, *b, 0, 0]))
        }
        [0x93, b'N', b'U', b'M', b'P', b'Y', 2 | 3, _, a, b, c, d, ..] => {
            (12, u32::from_le_bytes([*a, *b, *c, *d]))
        }
        _ => return Err("does not start as a .npy file of version 1, 2 or 3".into()),
    };
    let text = bytes[begin..].get(..length as usize).ok_or_else(|| {
        format!("the header is {length} bytes long, expected at most what the file holds, or 1 MiB")
    })?;
    Ok((
        String::from_utf8_lossy(text).into_owned(),
        begin + length as usize,
    ))
}

/// The text after a key, up to the dictionary's end.
fn value<'a>(text: &'a str, key: &str) -> Parsed<&'a str> {
    [format!("'{key}'"), format!("\"{key}\"")]
        .iter()
        .find_map(|quoted| text.split_once(quoted.as_str()))
        .and_then(|(_, rest)| rest.trim_start().strip_prefix(':'))
        .map(str::trim_start)
        .ok_or_else(|| format!("the header has no `{key}`"))
}

fn element(text: &str) -> Parsed<(VoxelType, Endian)> {
    let descr = value(text, "descr")?;
    let quoted = |quote| descr.strip_prefix(quote)?.split_once(quote);
    let Some((name, _)) = quoted('\'').or_else(|| quoted('"')) else {
        let list = descr.split_inclusive(']').next().unwrap_or(descr).trim();
        return Err(unexpected("descr", list, "one plain number type"));
    };
    VoxelType::numpy(name).ok_or_else(|| {
        let expected = format!("{}; use `array.astype`", VoxelType::NUMPY_NAMES);
        unexpected("descr", name, &expected)
    })
}

/// The dimensions, and a remark where users may expect others.
fn dims(text: &str) -> Parsed<([u32; 3], Option<String>)> {
    let shape = value(text, "shape")?;
    let quoted = shape.split_inclusive(')').next().unwrap_or(shape);
    let expected = "three whole numbers from 1 to 4294967295; save `array[n]` of an array with four axes, and \
                    `array[None]` of one with two";
    let wrong = || unexpected("shape", quoted, expected);
    let numbers = shape
        .strip_prefix('(')
        .and_then(|rest| rest.split_once(')'))
        .map(|(numbers, _)| numbers.trim().trim_end_matches(','))
        .ok_or_else(wrong)?;
    // Python 2 marks long integers.
    let size = |text: &str| text.trim().trim_end_matches('L').parse().ok();
    let sizes: Option<Vec<u32>> = numbers.split(',').map(size).collect();
    let [a, b, c] = match sizes.ok_or_else(wrong)?[..] {
        [a, b, c] | [1, a, b, c] | [a, b, c, 1] => [a, b, c],
        _ => return Err(wrong()),
    };
    match value(text, "fortran_order")? {
        order if order.starts_with("False") => Ok(([c, b, a], None)),
        order if order.starts_with("True") => {
            let note = "the array is in Fortran's order, so its first index is x; the last one would be in C's order";
            Ok(([a, b, c], Some(note.into())))
        }
        order => {
            let word = order.split([',', '}']).next().unwrap_or(order).trim();
            Err(unexpected("fortran_order", word, "True or False"))
        }
    }
}
