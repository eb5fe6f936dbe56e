//! Writes TIFF stacks, straight from the format's definition: strips or tiles, each codec, both predictors,
//! both byte orders, offsets of 32 or 64 bits.

#![allow(dead_code)] // The fuzzer uses less of it than the tests of formats.

use std::path::Path;

use isolume::scene::volume::{Endian, VoxelType};
use ruzstd::encoding::{CompressionLevel, compress_to_vec};
use weezl::BitOrder;
use weezl::encode::Encoder;

use crate::volume_files::{Array, write, zlib};

pub const PLAIN: u16 = 1;
pub const LZW: u16 = 5;
pub const DEFLATE: u16 = 8;
pub const PACKBITS: u16 = 32773;
pub const ZSTD: u16 = 50000;

#[derive(Debug, Clone)]
pub struct Tiff {
    pub is_big: bool,
    pub compression: u16,
    pub predictor: u16,
    /// Pixels of a tile; strips if there are none.
    pub tile: Option<[u32; 2]>,
    pub rows_per_strip: u32,
    /// Whether the last strip is as long as the others.
    pub pads_strips: bool,
    /// What a pixel's values are: 1 is grey, 2 red, green and blue.
    pub photometric: u16,
    /// Of the first page.
    pub description: String,
    /// Pixels in a unit of length.
    pub resolution: Option<[u32; 2]>,
    /// Further numbers of each page.
    pub more: Vec<(u16, u32)>,
}

impl Default for Tiff {
    fn default() -> Tiff {
        Tiff {
            is_big: false,
            compression: PLAIN,
            predictor: 1,
            tile: None,
            rows_per_strip: 2,
            pads_strips: false,
            photometric: 1,
            description: String::new(),
            resolution: None,
            more: Vec::new(),
        }
    }
}

/// A tag's values, as bytes.
struct Entry {
    tag: u16,
    kind: u16,
    count: usize,
    bytes: Vec<u8>,
}

impl Tiff {
    /// A page for each slice.
    pub fn write(&self, array: &Array) -> Vec<u8> {
        let slices = 0..array.dims[2];
        let pages: Vec<Array> = slices.map(|z| slice(array, z)).collect();
        self.write_pages(&pages)
    }

    /// A file of a folder for each slice, with the slice's name.
    pub fn write_files(&self, folder: &Path, array: &Array, name: impl Fn(u32) -> String) {
        for z in 0..array.dims[2] {
            write(folder, &name(z), self.write(&slice(array, z)));
        }
    }

    pub fn write_pages(&self, pages: &[Array]) -> Vec<u8> {
        let endian = pages[0].endian;
        let start: &[u8] = if endian == Endian::Little {
            b"II"
        } else {
            b"MM"
        };
        let mut file = start.to_vec();
        file.extend(number(if self.is_big { 43 } else { 42 }, 2, endian));
        if self.is_big {
            file.extend([number(8, 2, endian), number(0, 2, endian)].concat());
        }
        let offset = if self.is_big { 8 } else { 4 };
        let mut next = file.len();
        file.resize(next + offset, 0);
        for (n, page) in pages.iter().enumerate() {
            let mut places = Vec::new();
            for chunk in self.chunks(page) {
                file.resize(file.len().next_multiple_of(2), 0);
                places.push((file.len(), chunk.len()));
                file.extend(chunk);
            }
            let entries = self.entries(page, n == 0, &places);
            let mut placed = Vec::new();
            for entry in &entries {
                let value = if entry.bytes.len() <= offset {
                    [entry.bytes.clone(), vec![0; offset - entry.bytes.len()]].concat()
                } else {
                    file.resize(file.len().next_multiple_of(2), 0);
                    let at = number(file.len() as u64, offset, endian);
                    file.extend(&entry.bytes);
                    at
                };
                placed.push(value);
            }
            file.resize(file.len().next_multiple_of(2), 0);
            let at = number(file.len() as u64, offset, endian);
            file[next..next + offset].copy_from_slice(&at);
            let wide = if self.is_big { 8 } else { 2 };
            file.extend(number(entries.len() as u64, wide, endian));
            for (entry, value) in entries.iter().zip(placed) {
                file.extend(number(entry.tag.into(), 2, endian));
                file.extend(number(entry.kind.into(), 2, endian));
                file.extend(number(entry.count as u64, offset, endian));
                file.extend(value);
            }
            next = file.len();
            file.resize(next + offset, 0);
        }
        file
    }

    fn entries(&self, page: &Array, is_first: bool, places: &[(usize, usize)]) -> Vec<Entry> {
        let endian = page.endian;
        let [width, height, _] = page.dims;
        let short = |tag, value: u32| entry(tag, 3, 2, &[value.into()], endian);
        let long = |tag, value: u32| entry(tag, 4, 4, &[value.into()], endian);
        let format = match page.voxel_type {
            VoxelType::U8 | VoxelType::U16 | VoxelType::U32 | VoxelType::U64 => 1,
            VoxelType::I8 | VoxelType::I16 | VoxelType::I32 | VoxelType::I64 => 2,
            VoxelType::F16 | VoxelType::F32 | VoxelType::F64 => 3,
        };
        let (kind, wide) = if self.is_big { (16, 8) } else { (4, 4) };
        let offsets: Vec<u64> = places.iter().map(|place| place.0 as u64).collect();
        let counts: Vec<u64> = places.iter().map(|place| place.1 as u64).collect();
        let [at, length] = if self.tile.is_some() {
            [324, 325]
        } else {
            [273, 279]
        };
        let mut entries = vec![
            long(256, width),
            long(257, height),
            short(258, 8 * page.voxel_type.bytes() as u32),
            short(259, self.compression.into()),
            short(262, self.photometric.into()),
            entry(at, kind, wide, &offsets, endian),
            entry(length, kind, wide, &counts, endian),
            short(317, self.predictor.into()),
            short(339, format),
        ];
        match self.tile {
            Some([width, height]) => entries.extend([long(322, width), long(323, height)]),
            None => entries.push(long(278, self.rows_per_strip)),
        }
        if is_first && !self.description.is_empty() {
            let text = format!("{}\0", self.description);
            entries.push(Entry {
                tag: 270,
                kind: 2,
                count: text.len(),
                bytes: text.into_bytes(),
            });
        }
        for (tag, pixels) in [282, 283]
            .into_iter()
            .zip(self.resolution.into_iter().flatten())
        {
            let mut fraction = entry(tag, 5, 4, &[pixels.into(), 1], endian);
            fraction.count = 1;
            entries.push(fraction);
        }
        entries.extend(self.more.iter().map(|(tag, value)| long(*tag, *value)));
        entries.sort_by_key(|entry| entry.tag);
        entries
    }

    /// The packed strips or tiles of a page.
    fn chunks(&self, page: &Array) -> Vec<Vec<u8>> {
        let [width, height, _] = page.dims;
        let [across, down] = self.tile.unwrap_or([width, self.rows_per_strip]);
        let corners = (0..height).step_by(down as usize).flat_map(|y| {
            let columns = (0..width).step_by(across as usize);
            columns.map(move |x| [x, y])
        });
        let chunk = |[x, y]: [u32; 2]| {
            let rows = match self.tile {
                Some(_) => y..y + down,
                None if self.pads_strips => y..y + down,
                None => y..height.min(y + down),
            };
            let pixel = |x: u32, y: u32| {
                if x < width && y < height {
                    page.values[(y * width + x) as usize]
                } else {
                    0.0
                }
            };
            let row = |y: u32| Array {
                dims: [across, 1, 1],
                values: (x..x + across).map(|x| pixel(x, y)).collect(),
                ..page.clone()
            };
            let rows = rows.map(|y| self.predicted(&row(y)));
            self.packed(&rows.collect::<Vec<_>>())
        };
        corners.map(chunk).collect()
    }

    /// A row's bytes as differences.
    fn predicted(&self, row: &Array) -> Vec<u8> {
        let size = row.voxel_type.bytes();
        match self.predictor {
            2 => {
                let bytes = row.bytes();
                let mut left = 0;
                let difference = |bytes: &[u8]| {
                    let value = join(bytes, row.endian);
                    let difference = value.wrapping_sub(left);
                    left = value;
                    number(difference, size, row.endian)
                };
                bytes.chunks(size).flat_map(difference).collect()
            }
            3 => {
                let big = Array {
                    endian: Endian::Big,
                    ..row.clone()
                };
                let numbers = big.bytes();
                let apart = (0..size).flat_map(|n| numbers.iter().skip(n).step_by(size));
                let mut left = 0u8;
                let difference = |byte: &u8| {
                    let difference = byte.wrapping_sub(left);
                    left = *byte;
                    difference
                };
                apart.map(difference).collect()
            }
            _ => row.bytes(),
        }
    }

    fn packed(&self, rows: &[Vec<u8>]) -> Vec<u8> {
        let bytes = rows.concat();
        match self.compression {
            LZW => Encoder::with_tiff_size_switch(BitOrder::Msb, 8)
                .encode(&bytes)
                .unwrap(),
            DEFLATE => zlib(&bytes),
            PACKBITS => rows.iter().flat_map(|row| packbits(row)).collect(),
            ZSTD => compress_to_vec(&bytes[..], CompressionLevel::Fastest),
            _ => bytes,
        }
    }
}

/// Runs of at least 3 equal bytes, and all others as they are.
fn packbits(row: &[u8]) -> Vec<u8> {
    let (mut packed, mut plain, mut rest) = (Vec::new(), Vec::new(), row);
    let flush = |plain: &mut Vec<u8>, packed: &mut Vec<u8>| {
        for bytes in plain.chunks(128) {
            packed.push(bytes.len() as u8 - 1);
            packed.extend(bytes);
        }
        plain.clear();
    };
    while let [first, ..] = rest {
        let run = rest
            .iter()
            .take(128)
            .take_while(|byte| *byte == first)
            .count();
        if run >= 3 {
            flush(&mut plain, &mut packed);
            packed.extend([(1 - run as i16) as u8, *first]);
        } else {
            plain.extend(&rest[..run]);
        }
        rest = &rest[run..];
    }
    flush(&mut plain, &mut packed);
    packed
}

pub fn slice(array: &Array, z: u32) -> Array {
    let [x, y, _] = array.dims;
    let size = (x * y) as usize;
    Array {
        dims: [x, y, 1],
        values: array.values[z as usize * size..][..size].to_vec(),
        ..array.clone()
    }
}

fn entry(tag: u16, kind: u16, size: usize, values: &[u64], endian: Endian) -> Entry {
    let bytes = values.iter().flat_map(|value| number(*value, size, endian));
    Entry {
        tag,
        kind,
        count: values.len(),
        bytes: bytes.collect(),
    }
}

fn number(value: u64, size: usize, endian: Endian) -> Vec<u8> {
    let mut bytes = value.to_le_bytes()[..size].to_vec();
    if endian == Endian::Big {
        bytes.reverse();
    }
    bytes
}

fn join(bytes: &[u8], endian: Endian) -> u64 {
    let add = |number: u64, byte: &u8| number << 8 | u64::from(*byte);
    match endian {
        Endian::Little => bytes.iter().rev().fold(0, add),
        Endian::Big => bytes.iter().fold(0, add),
    }
}
