//! Packs chunks as Blosc 1 does, straight from the description of its format.

use super::zstd;
use crate::volume_files::zlib;

#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Blosc {
    pub inner: Inner,
    pub shuffle: u8,
    pub is_split: bool,
    /// Bytes of a block.
    pub block: usize,
}

#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Inner {
    BloscLz = 0,
    Lz4 = 1,
    Zlib = 3,
    Zstd = 4,
}

impl Inner {
    pub(super) fn name(self) -> &'static str {
        match self {
            Inner::BloscLz => "blosclz",
            Inner::Lz4 => "lz4",
            Inner::Zlib => "zlib",
            Inner::Zstd => "zstd",
        }
    }
}

impl Blosc {
    pub fn packed(&self, bytes: &[u8], size: usize) -> Vec<u8> {
        let blocks: Vec<&[u8]> = bytes.chunks(self.block).collect();
        let flags = (self.inner as u8) << 5 | self.shuffle | if self.is_split { 0 } else { 16 };
        let mut packed = vec![2, 1, flags, size as u8];
        for length in [bytes.len(), self.block.min(bytes.len()), 0] {
            packed.extend((length as u32).to_le_bytes());
        }
        let mut starts = packed.len();
        packed.resize(starts + 4 * blocks.len(), 0);
        for block in blocks {
            let at = (packed.len() as u32).to_le_bytes();
            packed[starts..starts + 4].copy_from_slice(&at);
            starts += 4;
            let shuffled = match self.shuffle {
                1 => shuffled(block, size),
                4 => bit_shuffled(block, size),
                _ => block.to_vec(),
            };
            let block_bytes = self.block.min(bytes.len());
            let is_split = self.is_split && block_bytes / size >= 128 && block.len() == block_bytes;
            let streams = if is_split { size } else { 1 };
            for stream in shuffled.chunks(shuffled.len() / streams) {
                let mut small = match self.inner {
                    Inner::BloscLz => blosclz(stream),
                    Inner::Lz4 => lz4_flex::block::compress(stream),
                    Inner::Zlib => zlib(stream),
                    Inner::Zstd => zstd(stream),
                };
                if small.len() >= stream.len() {
                    small = stream.to_vec();
                }
                packed.extend((small.len() as u32).to_le_bytes());
                packed.extend(small);
            }
        }
        let length = (packed.len() as u32).to_le_bytes();
        packed[12..16].copy_from_slice(&length);
        packed
    }
}

fn shuffled(block: &[u8], size: usize) -> Vec<u8> {
    let count = block.len() / size;
    let plane = |n: usize| block.iter().skip(n).step_by(size).take(count);
    let mut bytes: Vec<u8> = (0..size).flat_map(plane).copied().collect();
    bytes.extend(&block[count * size..]);
    bytes
}

fn bit_shuffled(block: &[u8], size: usize) -> Vec<u8> {
    let count = block.len() / size;
    if !count.is_multiple_of(8) {
        return block.to_vec();
    }
    let mut bytes = vec![0; count * size];
    for (n, element) in block.chunks_exact(size).enumerate() {
        for bit in (0..8 * size).filter(|bit| element[bit / 8] >> (bit % 8) & 1 == 1) {
            bytes[bit * (count / 8) + n / 8] |= 1 << (n % 8);
        }
    }
    bytes.extend(&block[count * size..]);
    bytes
}

/// Matches with what is 1, 256 or 10000 bytes back, and all other bytes as they are.
fn blosclz(bytes: &[u8]) -> Vec<u8> {
    let (mut packed, mut literals, mut at): (Vec<u8>, Vec<u8>, usize) = Default::default();
    let flush = |literals: &mut Vec<u8>, packed: &mut Vec<u8>| {
        for run in literals.chunks(32) {
            packed.push(run.len() as u8 - 1);
            packed.extend(run);
        }
        literals.clear();
    };
    while at < bytes.len() {
        let length = |distance: usize| {
            if at >= distance.max(2) {
                (0..bytes.len() - at)
                    .take_while(|n| bytes[at + n] == bytes[at + n - distance])
                    .count()
            } else {
                0
            }
        };
        let best = [1, 256, 10000]
            .into_iter()
            .max_by_key(|distance| length(*distance));
        let distance = best.unwrap();
        let found = length(distance);
        if found < 4 {
            literals.push(bytes[at]);
            at += 1;
            continue;
        }
        flush(&mut literals, &mut packed);
        at += found;
        let (far, back) = (distance > 8191, distance - 1);
        let high = if far { 31 } else { back >> 8 };
        let length = found - 2;
        packed.push(((length.min(7) << 5) | high) as u8);
        if length >= 7 {
            let mut more = length - 7;
            while more >= 255 {
                packed.push(255);
                more -= 255;
            }
            packed.push(more as u8);
        }
        if far {
            let rest = back - 8191;
            packed.extend([255, (rest >> 8) as u8, rest as u8]);
        } else {
            packed.push(back as u8)
        }
    }
    flush(&mut literals, &mut packed);
    packed
}
