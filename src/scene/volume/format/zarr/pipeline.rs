//! The steps by which the voxels of a chunk are encoded, by their names in Zarr.

use serde::Deserialize;

use crate::scene::volume::parsed::{Parsed, unexpected};
use crate::scene::volume::source::codec::Codec;
use crate::scene::volume::voxel_type::Endian;

/// The form of a file that holds several chunks, and of its index.
#[derive(Debug)]
pub struct Shard {
    pub shape: Vec<u64>,
    pub endian: Endian,
    pub has_checksum: bool,
    pub is_index_at_end: bool,
}

/// The codec whose chunks are files of chunks.
pub const SHARDING: &str = "sharding_indexed";

/// A name and its settings. A name alone may be written as a string.
#[derive(Deserialize)]
#[serde(
    untagged,
    expecting = "a codec, a grid or a key encoding is none of Zarr 3, expected its name and `configuration`"
)]
pub enum Named {
    Name(String),
    Configured {
        name: String,
        configuration: Option<Configuration>,
    },
}

/// The axes of a transposition. Its first drafts had names for two orders.
#[derive(Deserialize)]
#[serde(untagged)]
enum Order {
    Axes(Vec<usize>),
    Name(String),
}

/// The settings of all codecs, grids and encodings below.
#[derive(Deserialize, Default)]
pub struct Configuration {
    pub chunk_shape: Option<Vec<u64>>,
    pub separator: Option<String>,
    endian: Option<String>,
    order: Option<Order>,
    cname: Option<String>,
    codecs: Option<Vec<Named>>,
    index_codecs: Option<Vec<Named>>,
    index_location: Option<String>,
}

impl Named {
    pub fn name(&self) -> &str {
        match self {
            Named::Name(name) | Named::Configured { name, .. } => name,
        }
    }

    pub fn parts(self) -> (String, Configuration) {
        match self {
            Named::Name(name) => (name, Configuration::default()),
            Named::Configured {
                name,
                configuration,
            } => (name, configuration.unwrap_or_default()),
        }
    }
}

/// The shape of chunks in shards of `shape`, their index, and their codecs.
pub fn sharding(
    configuration: Configuration,
    shape: Vec<u64>,
) -> Parsed<(Vec<u64>, Shard, Vec<Named>)> {
    let (Some(chunk), Some(codecs), Some(index)) = (
        configuration.chunk_shape,
        configuration.codecs,
        configuration.index_codecs,
    ) else {
        return Err("`sharding_indexed` needs `chunk_shape`, `codecs` and `index_codecs`".into());
    };
    let index = Pipeline::new(index, shape.len() + 1)?;
    let is_in_order = index.order.iter().copied().eq(0..=shape.len());
    if index.codec != Codec::Plain || !is_in_order {
        return Err(
            "`index_codecs` of shards compress or change the order of axes, expected only bytes and crc32c".into(),
        );
    }
    let is_index_at_end = match configuration.index_location.as_deref() {
        None | Some("end") => true,
        Some("start") => false,
        Some(other) => return Err(unexpected("index_location", other, "start or end")),
    };
    let shard = Shard {
        shape,
        endian: index.endian.unwrap_or(Endian::NATIVE),
        has_checksum: index.has_checksum,
        is_index_at_end,
    };
    Ok((chunk, shard, codecs))
}

/// The encoding of the voxels of a chunk.
pub struct Pipeline {
    pub order: Vec<usize>,
    pub endian: Option<Endian>,
    pub codec: Codec,
    pub compression: Option<String>,
    pub has_checksum: bool,
}

impl Pipeline {
    /// Reads codecs in the order in which they encode: axes may change places, numbers become bytes, bytes are
    /// compressed, and a checksum follows.
    pub fn new(codecs: Vec<Named>, axes: usize) -> Parsed<Pipeline> {
        let mut pipeline = Pipeline {
            order: (0..axes).collect(),
            endian: None,
            codec: Codec::Plain,
            compression: None,
            has_checksum: false,
        };
        // The position of the codecs so far in this order.
        let mut stage = 0;
        for (name, configuration) in codecs.into_iter().map(Named::parts) {
            let next = match name.as_str() {
                "transpose" => 0,
                "bytes" => 1,
                "crc32c" => 3,
                _ => 2,
            };
            if next < stage || (next == stage && next > 0) {
                let expected = "transpose, bytes, one compressor and crc32c, in this order";
                return Err(unexpected("codecs", &name, expected));
            }
            stage = next;
            match next {
                0 => pipeline.transpose(configuration.order)?,
                1 => {
                    pipeline.endian = match configuration.endian.as_deref() {
                        None => None,
                        Some("little") => Some(Endian::Little),
                        Some("big") => Some(Endian::Big),
                        Some(other) => return Err(unexpected("endian", other, "little or big")),
                    }
                }
                3 => pipeline.has_checksum = true,
                _ => {
                    pipeline.codec = codec(&name)?;
                    pipeline.compression = Some(in_words(&name, configuration.cname));
                }
            }
        }
        Ok(pipeline)
    }

    fn transpose(&mut self, order: Option<Order>) -> Parsed<()> {
        let axes = 0..self.order.len();
        let order = match order {
            Some(Order::Axes(axes)) => axes,
            Some(Order::Name(name)) if name == "C" => axes.collect(),
            Some(Order::Name(name)) if name == "F" => axes.rev().collect(),
            Some(Order::Name(name)) => {
                return Err(unexpected("order", &name, "a list of axes, C or F"));
            }
            None => return Err("`transpose` has no `order`, expected a list of axes".into()),
        };
        let mut sorted = order.clone();
        sorted.sort_unstable();
        if !sorted.into_iter().eq(0..self.order.len()) {
            let expected = "each axis once";
            return Err(unexpected("transpose", &format!("{order:?}"), expected));
        }
        self.order = order.into_iter().map(|axis| self.order[axis]).collect();
        Ok(())
    }
}

pub fn codec(name: &str) -> Parsed<Codec> {
    match name {
        "blosc" | "numcodecs.blosc" => Ok(Codec::Blosc),
        "zstd" | "numcodecs.zstd" => Ok(Codec::Zstd),
        "gzip" | "numcodecs.gzip" => Ok(Codec::Gzip),
        "zlib" | "numcodecs.zlib" => Ok(Codec::Zlib),
        "lz4" | "numcodecs.lz4" => Ok(Codec::Lz4),
        "bz2" | "numcodecs.bz2" => Ok(Codec::Bzip2),
        SHARDING => Err(
            "its shards hold shards, which are not read; write the array again without the inner ones".into(),
        ),
        other => {
            let expected = "blosc, zstd, gzip, zlib, lz4 or bz2; write the array again with one of them";
            Err(unexpected("compressor", other, expected))
        }
    }
}

pub fn in_words(name: &str, inner: Option<String>) -> String {
    match inner {
        Some(inner) => format!("{name} ({inner})"),
        None => name.to_string(),
    }
}

pub fn separator(given: Option<&str>, default: char) -> Parsed<char> {
    match given {
        None => Ok(default),
        Some("/") => Ok('/'),
        Some(".") => Ok('.'),
        Some(other) => Err(unexpected("separator", other, "`/` or `.`")),
    }
}
