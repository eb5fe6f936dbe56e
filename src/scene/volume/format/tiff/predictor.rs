//! Differences in place of values, which compress better: TIFF 6, section 14, and Adobe's Photoshop TIFF Technical Note 3 for
//! floating-point numbers.

use crate::scene::volume::parsed::{Parsed, unexpected};
use crate::scene::volume::voxel_type::Endian;

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Predictor {
    None,
    /// A value is stored as its difference from the one on its left.
    Horizontal,
    /// The same for bytes; those of one significance lie together in a row.
    Float,
}

impl Predictor {
    pub fn of_number(number: u64) -> Parsed<Predictor> {
        match number {
            1 => Ok(Predictor::None),
            2 => Ok(Predictor::Horizontal),
            3 => Ok(Predictor::Float),
            other => Err(unexpected("Predictor", &other.to_string(), "1, 2 or 3")),
        }
    }

    /// Restores the values of a row of a strip or tile, which has so many of a pixel's samples side by side, of `size` bytes
    /// each.
    pub fn undo(self, row: &mut [u8], size: usize, samples: usize, endian: Endian) {
        match self {
            Predictor::None => {}
            Predictor::Horizontal => add_left(row, size, samples, endian),
            Predictor::Float => {
                add_left(row, 1, samples, endian);
                join_bytes(row, size, endian);
            }
        }
    }
}

/// Adds to each number the one of the same sample on its left.
fn add_left(row: &mut [u8], size: usize, samples: usize, endian: Endian) {
    macro_rules! sum {
        ($number:ty, $from:ident, $to:ident) => {
            |a, b| <$number>::$from(a).wrapping_add(<$number>::$from(b)).$to()
        };
    }
    match (size, endian) {
        (1, _) => add_up(row, samples, sum!(u8, from_ne_bytes, to_ne_bytes)),
        (2, Endian::Little) => add_up(row, samples, sum!(u16, from_le_bytes, to_le_bytes)),
        (2, Endian::Big) => add_up(row, samples, sum!(u16, from_be_bytes, to_be_bytes)),
        (4, Endian::Little) => add_up(row, samples, sum!(u32, from_le_bytes, to_le_bytes)),
        (4, Endian::Big) => add_up(row, samples, sum!(u32, from_be_bytes, to_be_bytes)),
        (_, Endian::Little) => add_up(row, samples, sum!(u64, from_le_bytes, to_le_bytes)),
        (_, Endian::Big) => add_up(row, samples, sum!(u64, from_be_bytes, to_be_bytes)),
    }
}

fn add_up<const SIZE: usize>(
    row: &mut [u8],
    samples: usize,
    sum: impl Fn([u8; SIZE], [u8; SIZE]) -> [u8; SIZE],
) {
    let numbers = row.as_chunks_mut().0;
    for n in samples..numbers.len() {
        numbers[n] = sum(numbers[n], numbers[n - samples]);
    }
}

/// Joins the bytes of a row's numbers, which are grouped by significance, the most significant first.
fn join_bytes(row: &mut [u8], size: usize, endian: Endian) {
    let apart = row.to_vec();
    let count = row.len() / size;
    for (n, number) in row.chunks_exact_mut(size).enumerate() {
        for (place, byte) in number.iter_mut().enumerate() {
            let significance = match endian {
                Endian::Big => place,
                Endian::Little => size - 1 - place,
            };
            *byte = apart[significance * count + n];
        }
    }
}
