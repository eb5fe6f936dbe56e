//! OME-Zarr 0.4 and 0.5: a folder of arrays, each the same image in another resolution, cut into chunks that are
//! files. <https://ngff.openmicroscopy.org/0.4/>, <https://ngff.openmicroscopy.org/0.5/>
//!
//! Axes may be time, channel, z, y and x, or some of them. One channel at one time in one resolution is the volume,
//! with x fastest whatever the array's order is. A Zarr array without OME's metadata is read by its own names of axes, or else
//! as z, y, x. No file says where a slice is in a body: the axes stay unknown.

mod array;
mod chunks;
mod crc32c;
mod files;
mod fill;
mod keys;
mod metadata;
mod ome;
mod pipeline;

use std::path::{Path, PathBuf};

use array::{Array, is_array};
use chunks::{ArrayChunks, Axis};
use ome::{image, metadata_file};

use super::header::Header;
use super::several::pick;
use crate::scene::volume::orientation::Orientation;
use crate::scene::volume::overrides::VolumeOverrides;
use crate::scene::volume::parsed::{Keyed, Parsed, unexpected};
use crate::scene::volume::source::chunked::Chunked;
use crate::scene::volume::source::codec::LARGEST_RATIO;
use crate::scene::volume::source::file::{shape, voxel_bytes};
use crate::scene::volume::storage::{Level, Storage, in_one_unit, symbol};

/// How many times as many voxels an array may have as its chunk files can decode to: chunks that have the fill value everywhere
/// need not be written.
const MOST_EMPTY: u64 = 32 << 10;

/// An axis that all of an image's arrays have.
struct Dimension {
    /// x, y, z, c or t, in lower case, or another name.
    name: String,
    unit: Option<String>,
}

impl Dimension {
    /// Channels and times may have any name where their type says what they are.
    fn new(name: &str, kind: Option<&str>, unit: Option<String>) -> Dimension {
        let name = match kind {
            Some("channel") => "c".into(),
            Some("time") => "t".into(),
            _ => name.to_lowercase(),
        };
        Dimension { name, unit }
    }
}

/// One resolution: an array, and its voxel size along each axis.
struct Resolution {
    array: Array,
    scale: Vec<f64>,
}

pub fn is_folder(path: &Path) -> bool {
    let files = [".zgroup", ".zattrs", ".zarray", "zarr.json"];
    files.iter().any(|name| path.join(name).is_file())
}

pub fn read_folder(path: &Path, overrides: &VolumeOverrides) -> Keyed<Header> {
    let is_array = is_array(path);
    let (dimensions, resolutions, names) = if is_array {
        let array = Array::read(path)?;
        let dimensions = dimensions_of(&array)?;
        let scale = vec![1.0; array.shape.len()];
        (dimensions, vec![Resolution { array, scale }], Vec::new())
    } else {
        image(path)?
    };
    let metadata = (!is_array).then(|| metadata_file(path));
    volume(&dimensions, resolutions, names, metadata, overrides)
}

/// The axes of an array alone: by its own names for them, if those are the usual ones, or else in the usual order.
fn dimensions_of(array: &Array) -> Parsed<Vec<Dimension>> {
    let usual = ["t", "c", "z", "y", "x"];
    let count = array.shape.len();
    let has = |names: &[String], wanted: &str| {
        let named = names
            .iter()
            .filter(|name| name.eq_ignore_ascii_case(wanted));
        named.count()
    };
    let are_usual = |names: &Vec<String>| {
        names.len() == count
            && usual.iter().map(|name| has(names, name)).sum::<usize>() == count
            && usual.iter().all(|name| has(names, name) <= 1)
            && ["x", "y"].iter().all(|name| has(names, name) == 1)
    };
    let names = match array.names.clone().filter(are_usual) {
        Some(names) => names,
        None => {
            let unnamed = usual.len().checked_sub(count);
            let many = || format!("has {count} axes, expected at most 5: t, c, z, y and x");
            let names = &usual[unnamed.ok_or_else(many)?..];
            names.iter().map(|name| name.to_string()).collect()
        }
    };
    let dimension = |name: &String| Dimension::new(name, None, None);
    Ok(names.iter().map(dimension).collect())
}

fn check_axes(dimensions: &[Dimension]) -> Parsed<()> {
    let count = |wanted: &str| dimensions.iter().filter(|it| it.name == wanted).count();
    let are_distinct = dimensions.iter().all(|it| count(&it.name) == 1);
    if are_distinct && count("x") == 1 && count("y") == 1 {
        return Ok(());
    }
    let names: Vec<&str> = dimensions.iter().map(|it| it.name.as_str()).collect();
    let expected = "x and y, at least, and each axis once";
    Err(unexpected("axes", &names.join(", "), expected))
}

/// One channel at one time in one resolution.
fn volume(
    dimensions: &[Dimension],
    mut resolutions: Vec<Resolution>,
    names: Vec<String>,
    metadata: Option<PathBuf>,
    overrides: &VolumeOverrides,
) -> Keyed<Header> {
    check_axes(dimensions)?;
    let level = pick("level", overrides.level, resolutions.len() as u32)?;
    let levels = resolutions
        .iter()
        .map(|resolution| level_of(dimensions, resolution))
        .collect::<Parsed<Vec<Level>>>()?;
    let Resolution { array, .. } = resolutions.swap_remove(level as usize);
    array.check_voxels()?;
    let length = |name: &str| {
        let mut lengths = dimensions.iter().zip(&array.shape);
        let found = lengths.find(|(dimension, _)| dimension.name == name);
        found.map_or(1, |(_, length)| u32::try_from(*length).unwrap_or(u32::MAX))
    };
    let channel = pick("channel", overrides.channel, length("c"))?;
    let time = pick("time", overrides.time, length("t"))?;
    let axes = axes(dimensions, &array.shape, channel, time)?;
    let Level { dims, spacing } = levels[level as usize].clone();
    let storage = Storage {
        compression: array.compression.clone(),
        unit: unit(dimensions, "x").map(symbol),
        channels: length("c"),
        channel_names: names,
        times: length("t"),
        levels,
        channel: Some(channel),
        time: Some(time),
        level: Some(level),
        ..Storage::default()
    };
    let expected = voxel_bytes(dims, array.voxel_type)?;
    check_promise(&array, expected, dims)?;
    let mut chunk = [1; 3];
    for (axis, size) in axes.iter().zip(&array.chunk) {
        if let Axis::Space(a) = axis {
            chunk[*a] = u32::try_from(*size).unwrap_or(u32::MAX).min(dims[*a]);
        }
    }
    let (voxel_type, endian) = (array.voxel_type, array.endian);
    let chunks = ArrayChunks::new(array, axes, metadata, chunk);
    let source = Chunked::new(dims, chunk, voxel_type.bytes(), Box::new(chunks));
    Ok(Header {
        geometry: Ok((spacing, Orientation::UNKNOWN)),
        notes: storage.notes(),
        storage,
        ..Header::of_source(Box::new(source), dims, voxel_type, endian)
    })
}

/// What each of an array's axes is for one channel at one time.
fn axes(dimensions: &[Dimension], shape: &[u64], channel: u32, time: u32) -> Parsed<Vec<Axis>> {
    let axis = |(dimension, length): (&Dimension, &u64)| {
        let name = dimension.name.as_str();
        match (space(name), name, length) {
            (Some(a), ..) => Ok(Axis::Space(a)),
            (None, "c", _) => Ok(Axis::Fixed(channel.into())),
            (None, "t", _) => Ok(Axis::Fixed(time.into())),
            (None, _, 1) => Ok(Axis::Fixed(0)),
            (None, other, _) => {
                let expected = "t, c, z, y, x, or one that is 1 long";
                Err(unexpected("axes", other, expected))
            }
        }
    };
    dimensions.iter().zip(shape).map(axis).collect()
}

fn space(name: &str) -> Option<usize> {
    ["x", "y", "z"].iter().position(|axis| *axis == name)
}

fn unit<'a>(dimensions: &'a [Dimension], axis: &str) -> Option<&'a str> {
    let found = dimensions.iter().find(|dimension| dimension.name == axis);
    found.and_then(|dimension| dimension.unit.as_deref())
}

fn level_of(dimensions: &[Dimension], resolution: &Resolution) -> Parsed<Level> {
    let mut dims = [1; 3];
    let mut spacing = [1.0; 3];
    for (n, dimension) in dimensions.iter().enumerate() {
        if let Some(a) = space(&dimension.name) {
            let size = resolution.array.shape[n];
            dims[a] = u32::try_from(size).map_err(|_| {
                let most = u32::MAX;
                format!(
                    "its axis {} is {size} long, expected at most {most}",
                    dimension.name
                )
            })?;
            spacing[a] = resolution.scale[n];
        }
    }
    let units = ["x", "y", "z"].map(|axis| unit(dimensions, axis));
    Ok(Level {
        dims,
        spacing: in_one_unit(spacing, units),
    })
}

/// Refuses an array that promises far more than its files hold, which would take a walk through nothing.
fn check_promise(array: &Array, expected: u64, dims: [u32; 3]) -> Parsed<()> {
    let enough = expected.div_ceil(MOST_EMPTY);
    let found = array.promised_bytes(LARGEST_RATIO, enough);
    if found >= enough {
        Ok(())
    } else {
        Err(format!(
            "its chunks are {found} bytes, decoded, which cannot hold {}: nearly all of them are missing, as they are \
             where an array holds nothing but its fill value, or its metadata is wrong",
            shape(dims, array.voxel_type)
        ))
    }
}
