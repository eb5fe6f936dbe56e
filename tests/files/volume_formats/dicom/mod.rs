//! DICOM: a volume is the same however its files are written, named and ordered; and where files form no
//! grid of voxels, it is said what was done, or why nothing could be.

mod assembly;
mod damage;
mod flavours;
mod frames;
mod identity;
mod repetitions;
mod series;
mod stored;

use std::path::Path;

use isolume::scene::volume::{Pick, Volume, VolumeOverrides};
use tempfile::TempDir;

use crate::dicom_files::Syntax;
use crate::dicom_scan::{COLUMNS, ROWS, SLICES, Scan, stored};
use crate::volume_formats::{folder, plain, values};

/// A volume, and the files that it is read from as long as anybody looks at it.
struct Loaded {
    volume: Volume,
    _folder: TempDir,
}

impl std::ops::Deref for Loaded {
    type Target = Volume;

    fn deref(&self) -> &Volume {
        &self.volume
    }
}

/// The volume that a scan's slices make.
fn loaded(scan: &Scan) -> Loaded {
    let folder = written(scan);
    Loaded {
        volume: plain(folder.path()),
        _folder: folder,
    }
}

fn written(scan: &Scan) -> TempDir {
    let folder = folder();
    scan.write(folder.path(), Syntax::Explicit, |n| format!("I{n}"));
    folder
}

fn picked(folder: &Path, pick: Pick) -> Result<Volume, isolume::error::Error> {
    let overrides = VolumeOverrides {
        series: Some(pick),
        ..VolumeOverrides::default()
    };
    Volume::load(folder, &overrides)
}

fn refused(folder: &Path, overrides: &VolumeOverrides) -> String {
    match Volume::load(folder, overrides) {
        Err(error) if error.is_about_input() => error.to_string(),
        other => panic!("{other:?}"),
    }
}

fn refused_scan(scan: &Scan) -> String {
    refused(written(scan).path(), &VolumeOverrides::default())
}

/// The Hounsfield units that the small CT means.
fn hounsfield() -> Vec<f64> {
    let slices = (0..SLICES).flat_map(|z| (0..ROWS).map(move |y| (y, z)));
    let places = slices.flat_map(|(y, z)| (0..COLUMNS).map(move |x| (x, y, z)));
    places
        .map(|(x, y, z)| f64::from(stored(x, y, z)) - 1024.0)
        .collect()
}

/// All that is known of a volume, to be compared.
fn everything(volume: &Volume) -> String {
    format!(
        "{:?} {:?} {:?} {:?} {} {} {:?} {:?} {:?}",
        volume.dims,
        volume.spacing,
        volume.axes,
        volume.stored,
        volume.scale,
        volume.offset,
        volume.range,
        volume.voxel_type,
        volume.voxels().unwrap()
    )
}

fn has(notes: &[String], part: &str) {
    assert!(
        notes.iter().any(|note| note.contains(part)),
        "`{part}` is not in {notes:?}"
    );
}
