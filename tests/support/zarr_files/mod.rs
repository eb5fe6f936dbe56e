//! Writes OME-Zarr folders of version 0.4 (Zarr 2) and 0.5 (Zarr 3), straight from their definitions.

#![allow(dead_code)] // The fuzzer uses less of it than the tests of formats.

pub mod blosc;

use std::fs;
use std::path::{Path, PathBuf};

use isolume::scene::volume::{Endian, VoxelType};
use lz4_flex::compress_prepend_size;
use ruzstd::encoding::{CompressionLevel, compress_to_vec};
use serde_json::{Value, json};

use crate::volume_files::{Array, bzip2, gzip, zlib};
use blosc::Blosc;

#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Codec {
    Plain,
    Gzip,
    Zlib,
    Zstd,
    Bzip2,
    Lz4,
    Blosc(Blosc),
}

#[derive(Debug, Clone)]
pub struct Zarr {
    pub is_version_3: bool,
    /// Along the array's axes.
    pub chunk: Vec<usize>,
    /// Only of version 3.
    pub shard: Option<Vec<usize>>,
    pub codec: Codec,
    pub separator: char,
    /// The array's axes in the order of a chunk's voxels.
    pub order: Vec<usize>,
    pub has_checksum: bool,
    pub is_index_at_end: bool,
    pub fill: Value,
    /// Chunks that are all this value are not written.
    pub unwritten: Option<f64>,
}

impl Zarr {
    pub fn new(is_version_3: bool, chunk: &[usize], codec: Codec) -> Zarr {
        Zarr {
            is_version_3,
            chunk: chunk.to_vec(),
            shard: None,
            codec,
            separator: '/',
            order: (0..chunk.len()).collect(),
            has_checksum: false,
            is_index_at_end: true,
            fill: json!(0),
            unwritten: None,
        }
    }

    /// An array of any shape, whose values are in its order. Gives the folder.
    pub fn write_array(&self, folder: &Path, shape: &[usize], array: &Array) -> PathBuf {
        fs::create_dir_all(folder).unwrap();
        let (name, metadata) = if self.is_version_3 {
            ("zarr.json", self.version_3(shape, array))
        } else {
            (".zarray", self.version_2(shape, array))
        };
        fs::write(folder.join(name), metadata.to_string()).unwrap();
        let outer = self.shard.as_ref().unwrap_or(&self.chunk);
        for place in places(&grid(shape, outer)) {
            let file = match &self.shard {
                None => self.chunk_at(shape, &place, array),
                Some(shard) => self.shard_at(shape, shard, &place, array),
            };
            let numbers = place.iter().map(usize::to_string);
            let prefix = self.is_version_3.then(|| "c".to_string());
            let parts: Vec<String> = prefix.into_iter().chain(numbers).collect();
            let path = folder.join(parts.join(&self.separator.to_string()));
            if let Some(bytes) = file {
                fs::create_dir_all(path.parent().unwrap()).unwrap();
                fs::write(path, bytes).unwrap();
            }
        }
        folder.to_path_buf()
    }

    /// One image in one resolution.
    pub fn write(&self, folder: &Path, axes: &str, shape: &[usize], array: &Array) -> PathBuf {
        let scale: Vec<f64> = axes
            .chars()
            .map(|axis| if axis == 'z' { 2.0 } else { 0.5 })
            .collect();
        self.write_array(&folder.join("s0"), shape, array);
        self.write_group(folder, axes, &[("s0", scale)]);
        folder.to_path_buf()
    }

    /// What says that arrays are the resolutions of one image.
    pub fn write_group(&self, folder: &Path, axes: &str, arrays: &[(&str, Vec<f64>)]) {
        let kind = |axis| match axis {
            't' => json!({"name": "t", "type": "time", "unit": "second"}),
            'c' => json!({"name": "c", "type": "channel"}),
            'z' => json!({"name": "z", "type": "space", "unit": "micrometer"}),
            axis => json!({"name": axis.to_string(), "type": "space", "unit": "micrometer"}),
        };
        let datasets: Vec<Value> = arrays
            .iter()
            .map(|(path, scale)| {
                let scale = json!({"type": "scale", "scale": scale});
                json!({"path": path, "coordinateTransformations": [scale]})
            })
            .collect();
        let axes: Vec<Value> = axes.chars().map(kind).collect();
        let version = if self.is_version_3 { "0.5" } else { "0.4" };
        let image =
            json!([{"version": version, "axes": axes, "datasets": datasets, "name": "Doe^Jane"}]);
        let labels = json!({"channels": [{"label": "DAPI"}, {"label": "GFP"}]});
        if self.is_version_3 {
            let ome = json!({"version": "0.5", "multiscales": image, "omero": labels});
            let group = json!({"zarr_format": 3, "node_type": "group", "attributes": {"ome": ome}});
            fs::write(folder.join("zarr.json"), group.to_string()).unwrap();
        } else {
            let attributes = json!({"multiscales": image, "omero": labels});
            fs::write(folder.join(".zgroup"), "{\"zarr_format\": 2}").unwrap();
            fs::write(folder.join(".zattrs"), attributes.to_string()).unwrap();
        }
    }

    fn version_2(&self, shape: &[usize], array: &Array) -> Value {
        let order = if self.order.is_sorted() { "C" } else { "F" };
        let endian = match (array.voxel_type.bytes(), array.endian) {
            (1, _) => '|',
            (_, Endian::Little) => '<',
            (_, Endian::Big) => '>',
        };
        let compressor = match self.codec {
            Codec::Plain => Value::Null,
            Codec::Gzip => json!({"id": "gzip", "level": 5}),
            Codec::Zlib => json!({"id": "zlib", "level": 5}),
            Codec::Zstd => json!({"id": "zstd", "level": 5}),
            Codec::Bzip2 => json!({"id": "bz2", "level": 1}),
            Codec::Lz4 => json!({"id": "lz4", "acceleration": 1}),
            Codec::Blosc(blosc) => json!({"id": "blosc", "cname": blosc.inner.name(), "clevel": 5}),
        };
        let (kind, size) = (kind(array.voxel_type), array.voxel_type.bytes());
        let letter = kind.chars().next().unwrap();
        json!({
            "zarr_format": 2, "shape": shape, "chunks": self.chunk, "order": order, "filters": null,
            "dtype": format!("{endian}{letter}{size}"), "compressor": compressor, "fill_value": self.fill,
            "dimension_separator": self.separator.to_string(),
        })
    }

    fn version_3(&self, shape: &[usize], array: &Array) -> Value {
        let endian = match array.endian {
            Endian::Little => "little",
            Endian::Big => "big",
        };
        let bytes = json!({"name": "bytes", "configuration": {"endian": endian}});
        let mut codecs = vec![bytes];
        if !self.order.is_sorted() {
            let transpose = json!({"name": "transpose", "configuration": {"order": self.order}});
            codecs.insert(0, transpose);
        }
        match self.codec {
            Codec::Plain => {}
            Codec::Gzip => codecs.push(json!({"name": "gzip", "configuration": {"level": 5}})),
            Codec::Zlib => codecs.push(json!("numcodecs.zlib")),
            Codec::Zstd => codecs.push(json!({"name": "zstd", "configuration": {"level": 5}})),
            Codec::Bzip2 => codecs.push(json!("numcodecs.bz2")),
            Codec::Lz4 => codecs.push(json!({"name": "numcodecs.lz4", "configuration": null})),
            Codec::Blosc(blosc) => {
                let configuration = json!({"cname": blosc.inner.name(), "clevel": 5});
                codecs.push(json!({"name": "blosc", "configuration": configuration}));
            }
        }
        if self.has_checksum {
            codecs.push(json!({"name": "crc32c"}));
        }
        if self.shard.is_some() {
            let index = json!([{"name": "bytes", "configuration": {"endian": "little"}}, {"name": "crc32c"}]);
            let location = if self.is_index_at_end { "end" } else { "start" };
            codecs = vec![json!({"name": "sharding_indexed", "configuration": {
                "chunk_shape": self.chunk, "codecs": codecs, "index_codecs": index, "index_location": location,
            }})];
        }
        let (kind, bits) = (kind(array.voxel_type), 8 * array.voxel_type.bytes());
        let separator = self.separator.to_string();
        json!({
            "zarr_format": 3, "node_type": "array", "shape": shape, "data_type": format!("{kind}{bits}"),
            "chunk_grid": {"name": "regular", "configuration": {
                "chunk_shape": self.shard.as_ref().unwrap_or(&self.chunk),
            }},
            "chunk_key_encoding": {"name": "default", "configuration": {"separator": separator}},
            "fill_value": self.fill, "codecs": codecs, "attributes": {},
        })
    }

    /// The bytes of the chunk at a place of the grid; `None` if it need not be written.
    fn chunk_at(&self, shape: &[usize], place: &[usize], array: &Array) -> Option<Vec<u8>> {
        let in_order = |values: &[usize]| self.order.iter().map(|axis| values[*axis]).collect();
        let sides: Vec<usize> = in_order(&self.chunk);
        let values = places(&sides).into_iter().map(|at| {
            let mut index = 0;
            for axis in 0..shape.len() {
                let inside = at[self.order.iter().position(|o| *o == axis).unwrap()];
                let n = place[axis] * self.chunk[axis] + inside;
                if n >= shape[axis] {
                    return 0.0;
                }
                index = index * shape[axis] + n;
            }
            array.values[index]
        });
        let chunk = Array {
            values: values.collect(),
            ..array.clone()
        };
        if self
            .unwritten
            .is_some_and(|fill| chunk.values.iter().all(|value| *value == fill))
        {
            return None;
        }
        let bytes = chunk.bytes();
        let mut packed = match self.codec {
            Codec::Plain => bytes,
            Codec::Gzip => gzip(&bytes),
            Codec::Zlib => zlib(&bytes),
            Codec::Zstd => zstd(&bytes),
            Codec::Bzip2 => bzip2(&bytes),
            Codec::Lz4 => compress_prepend_size(&bytes),
            Codec::Blosc(blosc) => blosc.packed(&bytes, array.voxel_type.bytes()),
        };
        if self.has_checksum {
            let sum = crc32c(&packed);
            packed.extend(sum.to_le_bytes());
        }
        Some(packed)
    }

    fn shard_at(
        &self,
        shape: &[usize],
        shard: &[usize],
        place: &[usize],
        array: &Array,
    ) -> Option<Vec<u8>> {
        let sides: Vec<usize> = shard.iter().zip(&self.chunk).map(|(a, b)| a / b).collect();
        let inner = places(&sides);
        let length = inner.len() * 16 + 4;
        let begin = if self.is_index_at_end { 0 } else { length };
        let (mut body, mut index) = (Vec::new(), Vec::new());
        for at in inner {
            let at: Vec<usize> = (0..at.len()).map(|a| place[a] * sides[a] + at[a]).collect();
            let is_inside = (0..at.len()).all(|a| at[a] * self.chunk[a] < shape[a]);
            let chunk = is_inside
                .then(|| self.chunk_at(shape, &at, array))
                .flatten();
            let entry = match &chunk {
                Some(chunk) => [(begin + body.len()) as u64, chunk.len() as u64],
                None => [u64::MAX; 2],
            };
            index.extend(entry.map(u64::to_le_bytes).concat());
            body.extend(chunk.unwrap_or_default());
        }
        index.extend(crc32c(&index).to_le_bytes());
        Some(if self.is_index_at_end {
            [body, index].concat()
        } else {
            [index, body].concat()
        })
    }
}

fn zstd(bytes: &[u8]) -> Vec<u8> {
    compress_to_vec(bytes, CompressionLevel::Fastest)
}

fn kind(voxel_type: VoxelType) -> &'static str {
    match voxel_type {
        VoxelType::U8 | VoxelType::U16 | VoxelType::U32 | VoxelType::U64 => "uint",
        VoxelType::I8 | VoxelType::I16 | VoxelType::I32 | VoxelType::I64 => "int",
        VoxelType::F16 | VoxelType::F32 | VoxelType::F64 => "float",
    }
}

fn grid(shape: &[usize], chunk: &[usize]) -> Vec<usize> {
    shape
        .iter()
        .zip(chunk)
        .map(|(a, b)| a.div_ceil(*b))
        .collect()
}

/// All places of a grid, the last axis fastest.
fn places(sides: &[usize]) -> Vec<Vec<usize>> {
    let mut places = vec![Vec::new()];
    for &side in sides {
        let longer = |place: &Vec<usize>| -> Vec<Vec<usize>> {
            (0..side)
                .map(|n| [place.clone(), vec![n]].concat())
                .collect()
        };
        places = places.iter().flat_map(longer).collect();
    }
    places
}

fn crc32c(bytes: &[u8]) -> u32 {
    let mut sum = !0u32;
    for byte in bytes {
        sum ^= u32::from(*byte);
        for _ in 0..8 {
            sum = (sum >> 1) ^ (0x82f6_3b78 & (sum & 1).wrapping_neg());
        }
    }
    !sum
}
