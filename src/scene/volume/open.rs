//! From a header to a [`Volume`]: the user's settings override those of the file, one scan of the voxels finds
//! what they mean, and left-handed axes become right-handed.

use std::ops::RangeInclusive;
use std::path::Path;
use std::sync::Arc;

use super::Volume;
use super::format;
use super::format::header::Header;
use super::grid::Grid;
use super::histogram::Histogram;
use super::orientation::{Axes, Orientation};
use super::overrides::VolumeOverrides;
use super::parsed::{Fault, Keyed, Parsed};
use super::reading::Reading;
use super::region::Region;
use super::scan::{Extremes, Scan, scan};
use super::series::{Preview, Series};
use super::source::memory::Memory;
use super::statistics::Statistics;
use super::store::file::Known;
use super::store::{Keeping, StoreFile, Stores};
use super::stored::{Conversion, Voxels};
use super::voxel_type::VoxelType;
use crate::error::{Error, Location, Result};
use crate::regular_file::{HAS_CHANGED, Version};

impl Volume {
    /// Opens a volume of any format, recognised by the file's name, and scans its voxels once.
    ///
    /// # Errors
    ///
    /// One sentence that names the file and says what is wrong with it.
    pub fn load(path: &Path, overrides: &VolumeOverrides) -> Result<Volume> {
        Volume::load_watched(path, overrides, &Reading::default(), None)
    }

    /// [`Volume::load`] while another thread waits: `reading` reports the progress to it, and lets it stop the
    /// reading. If `stores` knows the volume, there is no scan.
    ///
    /// # Errors
    ///
    /// Also when it was stopped.
    pub fn load_watched(
        path: &Path,
        overrides: &VolumeOverrides,
        reading: &Reading,
        stores: Option<&Stores>,
    ) -> Result<Volume> {
        let name = path.display().to_string();
        let stores = stores.map(|stores| (stores, path));
        let version = Version::at(path);
        format::read(path, overrides)
            .and_then(|header| {
                if Version::at(path) == version {
                    open(header, overrides, &name, reading, stores)
                } else {
                    // The header may belong to other voxels.
                    Err(HAS_CHANGED.into())
                }
            })
            .map_err(|fault| fault.in_file(&name))
    }

    /// The volumes of a folder or file that may hold several; none for a format that holds one.
    ///
    /// # Errors
    ///
    /// If it holds no volume.
    pub fn series(path: &Path) -> Result<Vec<Series>> {
        let name = path.display().to_string();
        format::series(path).map_err(|fault| Error::input(Location::file(&name), fault))
    }

    /// The same volumes with pictures of their middle slices, for the user to choose from; none if there is only one.
    /// It reads all headers and one slice of each volume.
    ///
    /// # Errors
    ///
    /// If the folder or file can no longer be read.
    pub fn previews(path: &Path) -> Result<Vec<Preview>> {
        let name = path.display().to_string();
        format::previews(path).map_err(|fault| Error::input(Location::file(&name), fault))
    }

    /// A volume made in memory; its values are the voxels themselves.
    ///
    /// # Errors
    ///
    /// If the number of voxels is not the product of `dims`, or 0; if a spacing is no length above 0; if no value is
    /// finite.
    pub fn from_values(dims: [u32; 3], spacing: [f64; 3], voxels: Voxels) -> Result<Volume> {
        let expected = dims.iter().map(|size| u128::from(*size)).product::<u128>();
        if expected == 0 || voxels.len() as u128 != expected {
            return Err(Error::value(format!(
                "{} values were given, expected {expected} for {dims:?} voxels, at least one",
                voxels.len()
            )));
        }
        let Conversion { from, endian, .. } = Conversion::none(voxels.stored());
        let source = Box::new(Memory { dims, voxels });
        let header = Header {
            geometry: Ok((spacing, Orientation::UNKNOWN)),
            ..Header::of_source(source, dims, from, endian)
        };
        let (overrides, reading) = (VolumeOverrides::default(), Reading::default());
        open(header, &overrides, "voxels in memory", &reading, None)
            .map_err(|fault| Error::value(fault.problem))
    }
}

fn open(
    header: Header,
    overrides: &VolumeOverrides,
    name: &str,
    reading: &Reading,
    stores: Option<(&Stores, &Path)>,
) -> Keyed<Volume> {
    let region = Region::cropped(header.dims, overrides.crop)?;
    let (spacing, orientation) = geometry(&header, overrides)?;
    let conversion = header.conversion()?;
    let is_mirrored = orientation.left_handed;
    let files = header.source.files();
    let store_file = stores.and_then(|(stores, path)| {
        stores.store_file(path, overrides, &header, &files, region, is_mirrored)
    });
    let mut notes = header.notes;
    let known = find(store_file.as_ref(), conversion, &mut notes);
    let mut grid = Grid {
        source: header.source,
        region,
        is_mirrored: false,
        conversion,
        filler: None,
        name: name.into(),
    };
    let (scan, histogram) = scanned(&mut grid, known, is_mirrored, reading)?;
    let extremes = scan.extremes;
    notes.extend(what_conversion_changes(&extremes, header.voxel_type));
    let axes = right_handed(orientation, &mut notes);
    let (scale, offset) = conversion.meaning();
    Ok(Volume {
        dims: region.dims,
        file_dims: header.dims,
        spacing,
        stored: conversion.stored(),
        scale,
        offset,
        range: range_of(conversion, &extremes)?,
        axes,
        file_axes: orientation.axes,
        voxel_type: header.voxel_type,
        storage: header.storage,
        notes,
        facts: header.about.facts,
        quantity: header.about.quantity,
        files,
        grid: Arc::new(grid),
        statistics: Arc::new(Statistics::new(scan.ranges, scan.counts, histogram)),
        keeping: store_file.map(|store_file| {
            Arc::new(Keeping {
                store_file,
                extremes,
            })
        }),
    })
}

/// What is known of the volume from before. What is damaged is not used.
fn find(
    store_file: Option<&StoreFile>,
    conversion: Conversion,
    notes: &mut Vec<String>,
) -> Option<Known> {
    store_file?
        .find(conversion.stored())
        .unwrap_or_else(|fault| {
            notes.push(format!("{fault}; it is ignored, and rebuilt if needed"));
            None
        })
}

/// Scans the voxels in the source's order, unless what that tells is known. From then on they are read in the
/// volume's order, which may be mirrored.
fn scanned(
    grid: &mut Grid,
    known: Option<Known>,
    is_mirrored: bool,
    reading: &Reading,
) -> Parsed<(Scan, Option<Histogram>)> {
    let (mut scan, histogram) = match known {
        Some(known) => (known.scan, known.histogram),
        None => (scan(grid, is_mirrored, reading)?, None),
    };
    let extremes = &scan.extremes;
    grid.filler = (extremes.infinite > 0).then_some(extremes.range[0]);
    grid.is_mirrored = is_mirrored;
    if let Some(voxels) = scan.kept.take() {
        grid.keep(voxels);
    }
    Ok((scan, histogram))
}

/// Remarks about values that are not kept as they are in the file.
fn what_conversion_changes(extremes: &Extremes, voxel_type: VoxelType) -> Vec<String> {
    let mut notes = Vec::new();
    if extremes.rounding > 0.0 {
        notes.push(format!(
            "{voxel_type} values are kept as float32, which changes some by up to {:.1e}",
            extremes.rounding
        ));
    }
    if extremes.infinite > 0 {
        notes.push(format!(
            "{} voxels are not finite float32 numbers and became the smallest value, {}",
            extremes.infinite,
            f64::from(extremes.range[0])
        ));
    }
    notes
}

/// The voxel size and the axes' directions: the user's, or else the file's.
fn geometry(header: &Header, overrides: &VolumeOverrides) -> Keyed<([f64; 3], Orientation)> {
    let axes = overrides.axes.map(Orientation::from);
    let (spacing, orientation) = match (overrides.spacing, axes) {
        (Some(spacing), Some(axes)) => (spacing, axes),
        (spacing, axes) => {
            let (its_spacing, its_axes) = header.geometry.clone().map_err(|fault| {
                format!("{fault}; give `spacing` and `axes`, which replace the file's")
            })?;
            (spacing.unwrap_or(its_spacing), axes.unwrap_or(its_axes))
        }
    };
    check_spacing(spacing).map_err(|problem| Fault {
        key: overrides.spacing.map(|_| "spacing"),
        problem,
    })?;
    Ok((spacing, orientation))
}

/// Voxel sizes with which the GPU can calculate: squares of lengths in world units must be within its floats of 32 bits.
pub const VOXEL_SIZES: RangeInclusive<f64> = 1e-15..=1e15;

fn check_spacing(spacing: [f64; 3]) -> Parsed<()> {
    for (axis, size) in ["x", "y", "z"].iter().zip(spacing) {
        if !VOXEL_SIZES.contains(&size) {
            return Err(format!(
                "the voxel size along {axis} is {size:?}, expected {:e} to {:e} world units; give `spacing`, if need be in \
                 another unit",
                VOXEL_SIZES.start(),
                VOXEL_SIZES.end()
            ));
        }
    }
    Ok(())
}

/// The smallest and the largest value.
fn range_of(conversion: Conversion, extremes: &Extremes) -> Parsed<[f64; 2]> {
    let (scale, offset) = conversion.meaning();
    let range = extremes
        .range
        .map(|stored| offset + scale * f64::from(stored));
    if range.iter().all(|value| (*value as f32).is_finite()) {
        Ok(range)
    } else {
        Err(format!(
            "values reach from {:e} to {:e}, expected them within float32",
            range[0], range[1]
        ))
    }
}

/// Left-handed axes would show the mirror image: the slowest one is reversed, and a note says so.
fn right_handed(orientation: Orientation, notes: &mut Vec<String>) -> Option<Axes> {
    if !orientation.left_handed {
        return orientation.axes;
    }
    let reverse = |Axes([i, j, k])| Axes([i, j, k.opposite()]);
    let reversed = orientation.axes.map(reverse);
    let letters = match (orientation.axes, reversed) {
        (Some(axes), Some(reversed)) => format!(": {axes} became {reversed}"),
        _ => String::new(),
    };
    notes.push(format!(
        "the volume's axes are left-handed, so the slowest of them is reversed{letters}"
    ));
    reversed
}
