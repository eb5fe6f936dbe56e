//! What stands before a grid's tree: the file's header, its list of grids, and a grid's metadata and transform
//! (`openvdb/io/Archive.cc`, `GridDescriptor.cc`).

use super::number::Number;
use super::packed::Compression;
use super::stream::Stream;
use super::transform::{self, Geometry};
use crate::error::first_of;
use crate::scene::volume::parsed::{Parsed, unexpected};
use crate::scene::volume::source::watched::WatchedFile;

const MAGIC: u64 = 0x5644_4220;
/// From this version on, each grid names its compression, and nodes have masks. OpenVDB 2.0 wrote it first, in 2013.
const FIRST_VERSION: u32 = 222;
const LAST_VERSION: u32 = 225;
/// The file's UUID, as text.
const UUID_BYTES: u64 = 36;
/// Bytes that are read at a time, which most metadata do not exceed.
const HEAD: u64 = 1 << 12;
/// Stands between a grid's name and a number, if several grids have one name.
const NAME_SEPARATOR: char = '\u{1e}';

/// An entry of the list of grids.
pub struct Listed {
    pub name: String,
    unique_name: String,
    grid_type: String,
    /// `None` if the grid holds anything else.
    number: Option<Number>,
    /// The unique name of the grid whose tree this one shares, or "".
    parent: String,
    /// Offset of the metadata.
    at: u64,
    /// Offset of the leaves.
    leaves: u64,
}

pub struct Archive {
    /// Grids of numbers.
    pub scalar: Vec<Listed>,
    /// Grids of anything else.
    others: Vec<Listed>,
}

/// A grid up to its tree.
#[derive(Debug)]
pub struct GridHead {
    pub number: Number,
    pub compression: Compression,
    /// Such as "fog volume" and "level set", or "".
    pub class: String,
    pub geometry: Geometry,
    /// Offsets of the nodes above the leaves, and of the leaves.
    pub nodes: u64,
    pub leaves: u64,
}

impl Archive {
    pub fn read(file: &WatchedFile) -> Parsed<Archive> {
        let mut stream = Stream::new(file, 0, HEAD);
        if file.bytes() < 8 || stream.u64()? != MAGIC {
            return Err("does not start as an OpenVDB file does".into());
        }
        let version = stream.u32()?;
        if !(FIRST_VERSION..=LAST_VERSION).contains(&version) {
            let remedy = if version < FIRST_VERSION {
                "; read it with OpenVDB and write it again"
            } else {
                ""
            };
            return Err(format!(
                "is OpenVDB of file version {version}, expected {FIRST_VERSION} to {LAST_VERSION}{remedy}"
            ));
        }
        // The library's version.
        stream.skip(8);
        if stream.u8()? == 0 {
            return Err(
                "was written as a stream, without the places of its grids; read it with OpenVDB and write it as a \
                 file"
                    .into(),
            );
        }
        stream.skip(UUID_BYTES);
        metadata(&mut stream, None)?;
        Archive::list(&mut stream)
    }

    /// The list of grids. Each entry stands before its grid and says where that ends.
    fn list(stream: &mut Stream) -> Parsed<Archive> {
        let (mut scalar, mut others) = (Vec::new(), Vec::new());
        for _ in 0..stream.u32()? {
            let unique_name = stream.text()?;
            let name = unique_name.split(NAME_SEPARATOR).next().unwrap_or_default();
            let grid_type = stream.text()?;
            let listed = Listed {
                name: name.to_string(),
                number: Number::of(&grid_type),
                grid_type,
                parent: stream.text()?,
                at: stream.u64()?,
                leaves: stream.u64()?,
                unique_name,
            };
            let end = stream.u64()?;
            if end < stream.at() {
                return Err(format!(
                    "its grid `{}` ends before it begins: the file is damaged, or was not written to its end",
                    listed.name
                ));
            }
            stream.seek(end);
            match listed.number {
                Some(_) => scalar.push(listed),
                None => others.push(listed),
            }
        }
        if scalar.is_empty() {
            Err(format!(
                "has no grid of {}; it has {}",
                Number::NAMES,
                if others.is_empty() {
                    "none at all".into()
                } else {
                    named(&others)
                }
            ))
        } else {
            Ok(Archive { scalar, others })
        }
    }

    /// A remark on grids that are not numbers.
    pub fn left_out(&self) -> Option<String> {
        let found = (!self.others.is_empty()).then(|| named(&self.others));
        found.map(|names| format!("grids of other types are left out: {names}"))
    }

    /// Reads the `n`th grid of numbers up to its tree.
    pub fn open(&self, file: &WatchedFile, n: usize) -> Parsed<GridHead> {
        let listed = &self.scalar[n];
        let grid = GridHead::read(file, listed)?;
        if listed.parent.is_empty() {
            return Ok(grid);
        }
        let is_parent = |other: &&Listed| other.unique_name == listed.parent;
        let parent = self.scalar.iter().find(is_parent);
        match parent.filter(|parent| parent.parent.is_empty()) {
            Some(parent) => Ok(GridHead {
                class: grid.class,
                geometry: grid.geometry,
                ..GridHead::read(file, parent)?
            }),
            None => {
                Err("it shares the tree of a grid that is not there: the file is damaged".into())
            }
        }
    }
}

impl GridHead {
    fn read(file: &WatchedFile, listed: &Listed) -> Parsed<GridHead> {
        let mut stream = Stream::new(file, listed.at, HEAD);
        Ok(GridHead {
            number: listed.number.ok_or_else(|| {
                let found = &listed.grid_type;
                unexpected(
                    "grid type",
                    found,
                    "one of numbers, such as Tree_float_5_4_3",
                )
            })?,
            compression: Compression::read(&mut stream)?,
            class: metadata(&mut stream, Some("class"))?,
            geometry: transform::read(&mut stream)?,
            nodes: stream.at(),
            leaves: listed.leaves,
        })
    }
}

/// Reads a list of named values, and returns the text with the wanted name, or "".
fn metadata(stream: &mut Stream, wanted: Option<&str>) -> Parsed<String> {
    let mut found = String::new();
    for _ in 0..stream.u32()? {
        let (name, kind) = (stream.text()?, stream.text()?);
        if wanted == Some(&name) && kind == "string" {
            found = stream.text()?
        } else {
            let bytes = stream.u32()?;
            stream.skip(bytes.into());
        }
    }
    Ok(found)
}

/// "`vel` (vec3s), `points` (ptdataidx32)"
fn named(grids: &[Listed]) -> String {
    const MOST: usize = 8;
    let name = |grid: &Listed| format!("`{}` ({})", grid.name, Number::name(&grid.grid_type));
    let names: Vec<String> = grids.iter().map(name).collect();
    first_of(&names, MOST)
}
