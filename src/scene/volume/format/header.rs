//! The result of every format: the shape, meaning and source of the voxels.
//!
//! A format's module only fills in a [`Header`]; all further steps are written once, for all formats. Messages made
//! here do not name the file, which is added once by the code that knows the path.
//!
//! Headers of medical files carry names and birthdays. Nothing but the fields below leaves a parser, and messages
//! quote only values of fields that are needed.

use std::collections::HashMap;
use std::io::Read;
use std::path::{Path, PathBuf};
use std::str::FromStr;

use crate::regular_file::open_file;
use crate::scene::volume::orientation::Orientation;
use crate::scene::volume::parsed::{Fault, Keyed, Parsed};
use crate::scene::volume::quantity::Quantity;
use crate::scene::volume::source::Source;
use crate::scene::volume::source::file::{Data, Encoding, Part, Start};
use crate::scene::volume::storage::Storage;
use crate::scene::volume::stored::Conversion;
use crate::scene::volume::voxel_type::{Endian, VoxelType};

#[derive(Debug)]
pub struct Header {
    /// Voxels along each axis, each ≥ 1.
    pub dims: [u32; 3],
    pub voxel_type: VoxelType,
    pub endian: Endian,
    /// The voxel size, and the axes' directions; or their fault, which counts unless the user gives both.
    pub geometry: Parsed<([f64; 3], Orientation)>,
    /// A voxel's value is intercept + slope · the number in the source.
    pub slope: f64,
    pub intercept: f64,
    pub storage: Storage,
    /// Remarks for the user: one sentence each.
    pub notes: Vec<String>,
    /// The source of `dims` voxels of the type and byte order above.
    pub source: Box<dyn Source>,
    pub about: About,
}

/// Further contents of a file beside the shape and meaning of its voxels.
#[derive(Debug, Default)]
pub struct About {
    /// Facts for `isolume info`: a name and a value each.
    pub facts: Vec<(&'static str, String)>,
    /// What the values are, where the file says it.
    pub quantity: Option<Quantity>,
}

impl Header {
    /// The header of plain voxels from byte `start` of a file that does not say where they are in the world.
    pub fn of_plain_file(
        path: &Path,
        start: u64,
        dims: [u32; 3],
        voxel_type: VoxelType,
        endian: Endian,
    ) -> Parsed<Header> {
        let data = Data {
            path: path.to_path_buf(),
            start: Start::At(start),
            encoding: Encoding::Raw,
            skip: 0,
            part: Part::WHOLE,
        };
        let source = data.open(path, dims, voxel_type)?;
        Ok(Header::of_source(source, dims, voxel_type, endian))
    }

    /// The header of voxels of which only the source is known.
    pub fn of_source(
        source: Box<dyn Source>,
        dims: [u32; 3],
        voxel_type: VoxelType,
        endian: Endian,
    ) -> Header {
        Header {
            dims,
            voxel_type,
            endian,
            geometry: Ok(([1.0; 3], Orientation::UNKNOWN)),
            slope: 1.0,
            intercept: 0.0,
            storage: Storage::default(),
            notes: Vec::new(),
            source,
            about: About::default(),
        }
    }

    /// The way from the source's numbers to what they mean.
    pub fn conversion(&self) -> Parsed<Conversion> {
        check_rescale(self.slope, self.intercept)?;
        Ok(Conversion {
            from: self.voxel_type,
            endian: self.endian,
            slope: self.slope,
            intercept: self.intercept,
        })
    }
}

/// Values must also survive the GPU's 32 bits.
pub fn check_rescale(slope: f64, intercept: f64) -> Parsed<()> {
    if (slope as f32).is_normal() && (intercept as f32).is_finite() {
        Ok(())
    } else {
        Err(format!(
            "values are rescaled with slope {slope} and intercept {intercept}, expected finite numbers \
             and a slope that is not 0"
        ))
    }
}

/// The first bytes of a file, where its header is.
pub fn first_bytes(path: &Path, limit: u64) -> Parsed<Vec<u8>> {
    let (file, _) = open_file(path)?;
    let mut bytes = Vec::new();
    file.take(limit)
        .read_to_end(&mut bytes)
        .map_err(|e| e.to_string())?;
    Ok(bytes)
}

/// The most bytes of a header of text lines.
pub const TEXT_LIMIT: u64 = 1 << 20;

/// The lines of a text header, each with the offset of the byte after it.
pub fn lines(bytes: &[u8]) -> impl Iterator<Item = (String, usize)> {
    let mut end = 0;
    bytes
        .split_inclusive(|byte| *byte == b'\n')
        .map(move |line| {
            end += line.len();
            (String::from_utf8_lossy(line).trim().to_string(), end)
        })
}

/// The `key: value` lines of a text header.
#[derive(Debug, Default)]
pub struct Fields(HashMap<String, String>);

impl Fields {
    /// Keys are compared without regard to case and spaces ("data file" is "datafile").
    pub fn insert(&mut self, key: &str, value: &str) {
        self.0
            .entry(canonical(key))
            .or_insert_with(|| value.trim().to_string());
    }

    pub fn get(&self, key: &str) -> Option<&str> {
        self.0.get(&canonical(key)).map(String::as_str)
    }

    pub fn require(&self, key: &str) -> Parsed<&str> {
        self.get(key)
            .ok_or_else(|| format!("the header has no `{key}`"))
    }

    /// One number.
    pub fn number<T: FromStr>(&self, key: &str, kind: &str) -> Parsed<Option<T>> {
        let parse = |value: &str| value.parse().map_err(|_| unexpected(key, value, kind));
        self.get(key).map(parse).transpose()
    }

    /// Exactly `count` numbers, separated by blanks.
    pub fn numbers<T: FromStr>(
        &self,
        key: &str,
        count: usize,
        kind: &str,
    ) -> Parsed<Option<Vec<T>>> {
        let Some(value) = self.get(key) else {
            return Ok(None);
        };
        let numbers: Result<Vec<T>, _> = value.split_whitespace().map(T::from_str).collect();
        let numbers = numbers.ok().filter(|numbers| numbers.len() == count);
        let wrong = || unexpected(key, value, &format!("{count} {kind}"));
        numbers.map(Some).ok_or_else(wrong)
    }

    /// The sizes along `count` axes.
    pub fn sizes(&self, key: &str, count: usize) -> Parsed<Vec<u32>> {
        self.require(key)?;
        let sizes = self.numbers(key, count, "whole numbers from 1 to 4294967295")?;
        Ok(sizes.unwrap_or_default())
    }
}

fn canonical(key: &str) -> String {
    key.to_ascii_lowercase().replace(' ', "")
}

/// "`sizes` is `4 5`, expected …"
pub fn unexpected(key: &str, value: &str, expected: &str) -> String {
    const SHOWN: usize = 80;
    let shown: String = value.chars().take(SHOWN).collect();
    let more = if value.chars().count() > SHOWN {
        "…"
    } else {
        ""
    };
    format!("`{key}` is `{shown}{more}`, expected {expected}")
}

/// Index of the channel, time or level of `count`, which is ≥ 1, that the user wants: the first by default.
pub fn pick(key: &'static str, wanted: Option<u32>, count: u32) -> Keyed<u32> {
    let wanted = wanted.unwrap_or(0);
    match (wanted < count, count) {
        (true, _) => Ok(wanted),
        (false, 1) => Err(Fault::of(
            key,
            format!("found {wanted}, expected 0: there is only one"),
        )),
        (false, _) => Err(Fault::of(
            key,
            format!("found {wanted}, expected 0 to {}", count - 1),
        )),
    }
}

/// The path of a data file named in a header, which lies beside the header.
pub fn beside(header: &Path, name: &str) -> PathBuf {
    header.parent().unwrap_or(Path::new("")).join(name)
}

/// Whether a header names several data files: by a list that follows, or by a pattern and the numbers to put into it, as in
/// "slice%03d.raw 1 9 1". A file that has this name, per cent signs and all, is meant as one file.
pub fn names_several_files(header: &Path, name: &str) -> bool {
    let mut words = name.split_whitespace();
    let first = words.next().unwrap_or_default();
    let numbers = words.rev().take_while(|word| word.parse::<i64>().is_ok());
    let is_conversion = |text: &str| {
        let letter = text.trim_start_matches(|c: char| c.is_ascii_digit());
        letter.starts_with(['d', 'i', 'u'])
    };
    let is_pattern = name.split('%').skip(1).any(is_conversion) && numbers.count() >= 3;
    (first == "LIST" || is_pattern) && !beside(header, name).is_file()
}
