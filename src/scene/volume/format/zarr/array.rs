//! The metadata of one Zarr array, of version 2 or 3, in a form common to both.
//!
//! <https://zarr-specs.readthedocs.io/en/latest/v2/v2.0.html>,
//! <https://zarr-specs.readthedocs.io/en/latest/v3/core/index.html>
//!
//! The crate `zarrs` reads these too. It takes 130 crates and several minutes of a first build in place of this
//! folder's few hundred lines, since a volume needs neither writing, nor stores on the network, nor the many codecs
//! and types that no volume has.

use std::path::{Path, PathBuf};

use serde::Deserialize;
use serde_json::Value;

use super::fill::fill;
use super::keys::Keys;
use super::metadata::json;
use super::pipeline::{Named, Pipeline, SHARDING, Shard, codec, in_words, separator, sharding};
use crate::scene::volume::parsed::{Parsed, unexpected};
use crate::scene::volume::source::codec::Codec;
use crate::scene::volume::voxel_type::{Endian, VoxelType};

/// An upper bound of the bytes of a chunk, which no file exceeds.
const LARGEST_CHUNK: u64 = 1 << 40;
/// An image has five.
const MOST_AXES: usize = 32;

#[derive(Debug)]
pub struct Array {
    pub folder: PathBuf,
    /// Slowest axis first, as are all the following.
    pub shape: Vec<u64>,
    /// The axes' names, if all have one.
    pub names: Option<Vec<String>>,
    /// The smallest boxes that are compressed as one.
    pub chunk: Vec<u64>,
    pub shard: Option<Shard>,
    pub voxel_type: VoxelType,
    pub endian: Endian,
    /// The axes of a chunk in the order in which its voxels lie, the slowest first.
    pub order: Vec<usize>,
    pub codec: Codec,
    /// Whether a checksum follows a chunk.
    pub has_checksum: bool,
    /// A voxel of a chunk that was never written, in the array's byte order.
    pub fill: Vec<u8>,
    pub keys: Keys,
    /// The compression's name, for users.
    pub compression: Option<String>,
}

pub fn is_array(folder: &Path) -> bool {
    folder.join(".zarray").is_file() || node_type(folder).as_deref() == Some("array")
}

fn node_type(folder: &Path) -> Option<String> {
    #[derive(Deserialize)]
    struct Node {
        node_type: String,
    }
    let node: Node = json(&folder.join("zarr.json")).ok()?;
    Some(node.node_type)
}

impl Array {
    pub fn read(folder: &Path) -> Parsed<Array> {
        let [version_2, version_3] = [".zarray", "zarr.json"].map(|name| folder.join(name));
        let array = if version_2.is_file() {
            json::<Version2>(&version_2)?.array(folder)?
        } else if version_3.is_file() {
            json::<Version3>(&version_3)?.array(folder)?
        } else {
            return Err(
                "has neither .zarray nor zarr.json: download it as well, or open another level alone, as \
                 in FOLDER/2, with volume.spacing"
                    .into(),
            );
        };
        array.check()?;
        Ok(array)
    }

    /// Bytes of a decoded chunk.
    pub fn chunk_bytes(&self) -> u64 {
        self.chunk.iter().product::<u64>() * self.voxel_type.bytes() as u64
    }

    /// The box of voxels that a file holds: that of a chunk, or of a shard.
    pub fn file_shape(&self) -> &[u64] {
        match &self.shard {
            None => &self.chunk,
            Some(shard) => &shard.shape,
        }
    }

    /// Bytes of all chunks that a file holds, decoded.
    pub fn file_bytes(&self) -> u64 {
        self.file_shape().iter().product::<u64>() * self.voxel_type.bytes() as u64
    }

    /// Fails for an array without voxels, as one may be to which nothing has been appended yet.
    pub fn check_voxels(&self) -> Parsed<()> {
        if self.shape.contains(&0) {
            return Err(format!(
                "the array is {:?} voxels, expected at least 1 along each axis",
                self.shape
            ));
        }
        Ok(())
    }

    fn check(&self) -> Parsed<()> {
        let size = self.voxel_type.bytes() as u64;
        let fits = |shape: &[u64]| {
            let bytes = shape
                .iter()
                .try_fold(size, |bytes, side| bytes.checked_mul(*side));
            bytes.is_some_and(|bytes| (1..=LARGEST_CHUNK).contains(&bytes))
        };
        let outer = self.file_shape();
        if self.shape.is_empty() || self.chunk.len() != self.shape.len() {
            return Err(format!(
                "the array has {} axes and its chunks {}, expected as many and at least one",
                self.shape.len(),
                self.chunk.len()
            ));
        }
        if self.shape.len() > MOST_AXES {
            return Err(format!(
                "the array has {} axes, expected at most {MOST_AXES}",
                self.shape.len()
            ));
        }
        if outer.len() != self.shape.len() || !fits(&self.chunk) || !fits(outer) {
            return Err(format!(
                "its chunks are {:?}, expected at least one voxel and less than any file holds",
                outer
            ));
        }
        let divides = |(outer, chunk): (&u64, &u64)| outer.is_multiple_of(*chunk);
        if outer.iter().zip(&self.chunk).all(divides) {
            Ok(())
        } else {
            Err(format!(
                "its shards are {outer:?}, expected a multiple of its chunks, {:?}",
                self.chunk
            ))
        }
    }
}

#[derive(Deserialize)]
struct Version2 {
    shape: Vec<u64>,
    chunks: Vec<u64>,
    dtype: Value,
    compressor: Option<Compressor>,
    #[serde(default)]
    filters: Option<Vec<Compressor>>,
    #[serde(default)]
    fill_value: Value,
    order: String,
    dimension_separator: Option<String>,
}

#[derive(Deserialize)]
struct Compressor {
    id: String,
    cname: Option<String>,
}

impl Version2 {
    fn array(self, folder: &Path) -> Parsed<Array> {
        if let Some(filter) = self.filters.unwrap_or_default().first() {
            let expected = "none; write the array again without filters";
            return Err(unexpected("filters", &filter.id, expected));
        }
        let (voxel_type, endian) = match &self.dtype {
            Value::String(name) => numpy_type(name)?,
            other => {
                return Err(unexpected(
                    "dtype",
                    &other.to_string(),
                    "one plain number type",
                ));
            }
        };
        let codec = match &self.compressor {
            None => Codec::Plain,
            Some(compressor) => codec(&compressor.id)?,
        };
        let mut order: Vec<usize> = (0..self.shape.len()).collect();
        match self.order.as_str() {
            "C" => {}
            "F" => order.reverse(),
            other => return Err(unexpected("order", other, "C or F")),
        }
        // Older versions of n5-zarr nest chunks in folders and do not say so.
        let usual = if self.shape.len() > 1 && folder.join("0").is_dir() {
            '/'
        } else {
            '.'
        };
        Ok(Array {
            folder: folder.to_path_buf(),
            shape: self.shape,
            names: names_by_xarray(folder),
            chunk: self.chunks,
            shard: None,
            voxel_type,
            endian,
            order,
            codec,
            has_checksum: false,
            fill: fill(&self.fill_value, voxel_type, endian)?,
            keys: Keys {
                prefix: "",
                separator: separator(self.dimension_separator.as_deref(), usual)?,
            },
            compression: self.compressor.map(|it| in_words(&it.id, it.cname)),
        })
    }
}

/// The names of the axes as xarray writes them: version 2 has no place of its own for them. Attributes are free, so what is
/// no list of names here is another program's and no fault.
fn names_by_xarray(folder: &Path) -> Option<Vec<String>> {
    #[derive(Deserialize)]
    struct Attributes {
        #[serde(rename = "_ARRAY_DIMENSIONS")]
        names: Vec<String>,
    }
    let attributes: Attributes = json(&folder.join(".zattrs")).ok()?;
    Some(attributes.names)
}

#[derive(Deserialize)]
struct Version3 {
    shape: Vec<u64>,
    data_type: Value,
    chunk_grid: Named,
    chunk_key_encoding: Named,
    #[serde(default)]
    fill_value: Value,
    codecs: Vec<Named>,
    dimension_names: Option<Vec<Option<String>>>,
}

impl Version3 {
    fn array(self, folder: &Path) -> Parsed<Array> {
        let voxel_type = match &self.data_type {
            Value::String(name) => zarr_type(name)?,
            other => return Err(unexpected("data_type", &other.to_string(), "a number type")),
        };
        let keys = keys(self.chunk_key_encoding)?;
        let (chunk, shard, codecs) = unsharded(self.codecs, chunk_shape(self.chunk_grid)?)?;
        let pipeline = Pipeline::new(codecs, self.shape.len())?;
        let endian = pipeline.endian.unwrap_or(Endian::NATIVE);
        let compression = match (pipeline.compression, &shard) {
            (Some(name), Some(_)) => Some(format!("{name}, in shards")),
            (None, Some(_)) => Some("none, in shards".into()),
            (name, None) => name,
        };
        Ok(Array {
            folder: folder.to_path_buf(),
            chunk,
            shard,
            voxel_type,
            endian,
            order: pipeline.order,
            codec: pipeline.codec,
            has_checksum: pipeline.has_checksum,
            fill: fill(&self.fill_value, voxel_type, endian)?,
            keys,
            compression,
            shape: self.shape,
            names: self
                .dimension_names
                .and_then(|names| names.into_iter().collect()),
        })
    }
}

fn chunk_shape(grid: Named) -> Parsed<Vec<u64>> {
    let (name, configuration) = grid.parts();
    let shape = configuration.chunk_shape.filter(|_| name == "regular");
    shape.ok_or_else(|| unexpected("chunk_grid", &name, "regular, with its `chunk_shape`"))
}

/// How a version 3 array names its chunks.
fn keys(encoding: Named) -> Parsed<Keys> {
    let (encoding, configuration) = encoding.parts();
    let given = configuration.separator.as_deref();
    match encoding.as_str() {
        "default" => Ok(Keys {
            prefix: "c",
            separator: separator(given, '/')?,
        }),
        "v2" => Ok(Keys {
            prefix: "",
            separator: separator(given, '.')?,
        }),
        other => Err(unexpected("chunk_key_encoding", other, "default or v2")),
    }
}

/// The shape of the chunks that are read, the shards that hold them, if any do, and the chunks' codecs. `shape` is that of the
/// chunks to which `codecs` belong.
fn unsharded(
    mut codecs: Vec<Named>,
    shape: Vec<u64>,
) -> Parsed<(Vec<u64>, Option<Shard>, Vec<Named>)> {
    if !codecs.iter().any(|codec| codec.name() == SHARDING) {
        return Ok((shape, None, codecs));
    }
    if codecs.len() > 1 {
        let names: Vec<&str> = codecs.iter().map(Named::name).collect();
        let expected = format!("{SHARDING} alone; write the array again with all others inside it");
        return Err(unexpected("codecs", &names.join(", "), &expected));
    }
    let (_, configuration) = codecs.remove(0).parts();
    let (chunk, shard, codecs) = sharding(configuration, shape)?;
    Ok((chunk, Some(shard), codecs))
}

fn numpy_type(name: &str) -> Parsed<(VoxelType, Endian)> {
    VoxelType::numpy(name).ok_or_else(|| unexpected("dtype", name, VoxelType::NUMPY_NAMES))
}

fn zarr_type(name: &str) -> Parsed<VoxelType> {
    let bits = name.trim_start_matches(|letter: char| !letter.is_ascii_digit());
    let kind = &name[..name.len() - bits.len()];
    let known = match (kind, bits.parse().unwrap_or(0)) {
        ("bool", _) => Some(VoxelType::U8),
        ("uint", bits) => VoxelType::integer(bits, false),
        ("int", bits) => VoxelType::integer(bits, true),
        ("float", bits) => VoxelType::float(bits),
        _ => None,
    };
    let expected = "an integer of 8, 16, 32 or 64 bits, float16, float32, float64 or bool";
    known.ok_or_else(|| unexpected("data_type", name, expected))
}
