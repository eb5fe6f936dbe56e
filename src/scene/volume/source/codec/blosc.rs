//! Blosc 1, the usual compressor of Zarr: <https://github.com/Blosc/c-blosc/blob/main/README_CHUNK_FORMAT.rst>.
//!
//! A buffer is cut into blocks, each block may be cut into as many streams as an element has bytes, and each stream
//! is compressed with one of five codecs. Before that, the bytes or bits of a block's elements are grouped by their
//! significance.

use super::{Codec, blosclz};
use crate::scene::volume::parsed::Parsed;

const HEADER: usize = 16;
const BYTE_SHUFFLE: u8 = 1;
const IS_PLAIN: u8 = 2;
const BIT_SHUFFLE: u8 = 4;
const IS_NOT_SPLIT: u8 = 16;
/// Blocks are only cut into streams where elements are small and streams large enough.
const MOST_STREAMS: usize = 16;
const LEAST_STREAM: usize = 128;

/// A buffer with the fields of its header.
struct Buffer<'a> {
    bytes: &'a [u8],
    flags: u8,
    element: usize,
    length: usize,
    block: usize,
}

pub fn decode(packed: &[u8], expected: usize) -> Parsed<Vec<u8>> {
    let buffer = Buffer::new(packed)?;
    if buffer.length != expected {
        return Err(format!(
            "its header says {} bytes, expected {expected}",
            buffer.length
        ));
    }
    if buffer.flags & IS_PLAIN != 0 {
        let plain = packed.get(HEADER..HEADER + expected);
        return plain
            .map(<[u8]>::to_vec)
            .ok_or_else(|| "it is truncated".into());
    }
    let mut decoded = super::reserved(packed, expected);
    for n in 0..buffer.length.div_ceil(buffer.block.max(1)) {
        let length = buffer.block.min(buffer.length - n * buffer.block);
        let block = buffer.block(n, length)?;
        match buffer.flags {
            flags if flags & BYTE_SHUFFLE != 0 && buffer.element > 1 => {
                unshuffle(&block, buffer.element, &mut decoded);
            }
            flags if flags & BIT_SHUFFLE != 0 && length >= buffer.element => {
                unshuffle_bits(&block, buffer.element, &mut decoded);
            }
            _ => decoded.extend_from_slice(&block),
        }
    }
    Ok(decoded)
}

impl<'a> Buffer<'a> {
    fn new(bytes: &'a [u8]) -> Parsed<Buffer<'a>> {
        let Some(&[version, _, flags, element, ..]) = bytes.first_chunk::<HEADER>() else {
            return Err(format!(
                "it has {} bytes, fewer than its header",
                bytes.len()
            ));
        };
        if version > 2 {
            return Err(format!(
                "its header says version {version} of Blosc, expected 1 or 2; write it again with Blosc 1"
            ));
        }
        let buffer = Buffer {
            bytes,
            flags,
            element: usize::from(element).max(1),
            length: word(bytes, 4)?,
            block: word(bytes, 8)?,
        };
        match buffer.block {
            0 if buffer.length > 0 => {
                Err("its header says blocks of 0 bytes, expected at least 1".into())
            }
            _ => Ok(buffer),
        }
    }

    /// The bytes of block `n`, still shuffled.
    fn block(&self, n: usize, length: usize) -> Parsed<Vec<u8>> {
        let begin = word(self.bytes, HEADER + 4 * n)?;
        let mut rest = self.bytes.get(begin..).ok_or_else(|| {
            let all = self.bytes.len();
            format!("block {n} begins at byte {begin}, expected within its {all} bytes")
        })?;
        let is_split = self.flags & IS_NOT_SPLIT == 0
            && self.element <= MOST_STREAMS
            && self.block / self.element >= LEAST_STREAM
            && length == self.block;
        let streams = if is_split { self.element } else { 1 };
        let mut block = Vec::new();
        for _ in 0..streams {
            let packed = word(rest, 0)?;
            let (packed, after) = rest[4..].split_at_checked(packed).ok_or_else(|| {
                let left = rest.len() - 4;
                format!(
                    "block {n} is {packed} bytes long, expected at most the {left} that are left"
                )
            })?;
            rest = after;
            let expected = length / streams;
            if packed.len() == expected {
                block.extend_from_slice(packed)
            } else {
                block.extend(self.stream(packed, expected)?)
            }
        }
        if block.len() == length {
            Ok(block)
        } else {
            Err(format!(
                "a block decodes to {} bytes, expected {length}",
                block.len()
            ))
        }
    }

    fn stream(&self, packed: &[u8], expected: usize) -> Parsed<Vec<u8>> {
        match self.flags >> 5 {
            0 => blosclz::decode(packed, expected),
            1 => super::lz4(packed, expected),
            3 => Codec::Zlib.unpack(packed, expected),
            4 => Codec::Zstd.unpack(packed, expected),
            2 => Err(
                "it is compressed with Snappy, expected blosclz, lz4, zlib or zstd; write it again with one of them"
                    .into(),
            ),
            other => Err(format!(
                "its header names codec {other}, expected 0, 1, 3 or 4: blosclz, lz4, zlib or zstd"
            )),
        }
    }
}

fn word(bytes: &[u8], at: usize) -> Parsed<usize> {
    let word = bytes.get(at..).and_then(<[u8]>::first_chunk);
    match word {
        Some(word) => Ok(u32::from_le_bytes(*word) as usize),
        None => Err("it is truncated".into()),
    }
}

/// Ungroups bytes, which were grouped by their place in an element; those after the last whole element were not.
fn unshuffle(block: &[u8], element: usize, decoded: &mut Vec<u8>) {
    let count = block.len() / element;
    let begin = decoded.len();
    decoded.resize(begin + count * element, 0);
    for (n, plane) in block.chunks_exact(count.max(1)).take(element).enumerate() {
        let places = decoded[begin..].iter_mut().skip(n).step_by(element);
        places.zip(plane).for_each(|(place, byte)| *place = *byte);
    }
    decoded.extend_from_slice(&block[count * element..]);
}

/// Ungroups bits, which were grouped by their place in an element if the number of elements is a multiple of 8;
/// otherwise nothing was done.
fn unshuffle_bits(block: &[u8], element: usize, decoded: &mut Vec<u8>) {
    let count = match block.len() / element {
        count if count.is_multiple_of(8) => count,
        _ => 0,
    };
    let begin = decoded.len();
    decoded.resize(begin + count * element, 0);
    let plane_bytes = count / 8;
    for (bit, plane) in block
        .chunks_exact(plane_bytes.max(1))
        .take(8 * element)
        .enumerate()
    {
        for (n, byte) in plane.iter().enumerate().take(plane_bytes) {
            for inner in (0..8).filter(|inner| byte >> inner & 1 != 0) {
                decoded[begin + (8 * n + inner) * element + bit / 8] |= 1 << (bit % 8);
            }
        }
    }
    decoded.extend_from_slice(&block[count * element..]);
}
