//! The file formats: which there are, and how each is told by a file's name or a folder's content.
//!
//! A format is one module, which makes a [`Header`] of a file, and one line in [`FORMATS`] or [`FOLDERS`].
//! Voxels that do not lie in one file, plain or deflated, come with a [`Source`](super::source::Source) of
//! their own.

pub mod header;
mod metaimage;
mod nifti;
mod npy;
mod nrrd;
mod raw;
mod tiff;
mod zarr;

use std::path::Path;

use super::overrides::VolumeOverrides;
use super::parsed::Parsed;
use header::Header;

enum Read {
    /// The file says what its voxels are.
    Described(fn(&Path) -> Parsed<Header>),
    /// It may hold several volumes, of which the user picks one.
    Several(fn(&Path, &VolumeOverrides) -> Parsed<Header>),
    /// The user says what its voxels are.
    Bare(fn(&Path, &VolumeOverrides) -> Parsed<Header>),
    /// The format is known and not read: the sentence says what can be done instead.
    Refused(&'static str),
}

use Read::*;

/// Each with the ends of its files' names, in lower case.
const FORMATS: [(&str, &[&str], Read); 8] = [
    ("NRRD", &[".nrrd", ".nhdr"], Described(nrrd::read)),
    ("MetaImage", &[".mha", ".mhd"], Described(metaimage::read)),
    ("NIfTI", &[".nii", ".nii.gz"], Described(nifti::read)),
    ("NumPy", &[".npy"], Described(npy::read)),
    ("TIFF", &[".tif", ".tiff"], Several(tiff::read)),
    ("raw", &[".raw"], Bare(raw::read)),
    (
        "OpenVDB",
        &[".vdb"],
        Refused(
            "is OpenVDB, which is not read directly; convert its grid first, with OpenVDB for Python: \
             `numpy.save(\"grid.npy\", array)` after `grid.copyToArray(array)`, its axes turned to z, y, x",
        ),
    ),
    (
        "DICOM",
        &[".dcm", ".dicom"],
        Refused(
            "is DICOM, which is not read directly; convert its series first: \
             `dcm2niix -z y -o OUT FOLDER`",
        ),
    ),
];

/// How a folder is told to be of a format.
type IsFolder = fn(&Path) -> bool;

/// The first one that a folder is of reads it.
const FOLDERS: [(&str, IsFolder, Read); 2] = [
    ("OME-Zarr", zarr::is_folder, Several(zarr::read_folder)),
    ("TIFF pages", tiff::is_folder, Several(tiff::read_folder)),
];

pub(super) fn read(path: &Path, overrides: &VolumeOverrides) -> Parsed<Header> {
    if path.to_string_lossy().contains("://") {
        return Err(
            "is an address on the network, expected a file or folder on this machine; download it \
             first, an OME-Zarr with `ome_zarr download`"
                .into(),
        );
    }
    let (name, read) = match path.is_dir() {
        true => folder(path)?,
        false => file(path)?,
    };
    check_keys(read, overrides)?;
    let header = match read {
        Described(read) => read(path),
        Several(read) | Bare(read) => read(path, overrides),
        Refused(why) => Err(why.to_string()),
    };
    header.map(|mut header| {
        header.storage.format = name;
        header
    })
}

fn file(path: &Path) -> Parsed<(&'static str, &'static Read)> {
    let name = path.file_name().unwrap_or_default().to_string_lossy();
    let name = name.to_lowercase();
    let is_named = |end: &&str| name.ends_with(*end);
    let format = FORMATS
        .iter()
        .find(|(_, ends, _)| ends.iter().any(is_named));
    match format {
        Some((name, _, read)) => Ok((name, read)),
        None => Err(format!("has an unknown extension, expected {}", readable())),
    }
}

fn folder(path: &Path) -> Parsed<(&'static str, &'static Read)> {
    let format = FOLDERS.iter().find(|(_, is_of, _)| is_of(path));
    match format {
        Some((name, _, read)) => Ok((name, read)),
        None => Err(format!(
            "is a folder without {}; convert a DICOM series first: `dcm2niix -z y -o OUT FOLDER`",
            FOLDERS.map(|(name, ..)| name).join(" or ")
        )),
    }
}

/// A key that a format has no use for is a mistake.
fn check_keys(read: &Read, overrides: &VolumeOverrides) -> Parsed<()> {
    let is_bare = matches!(read, Bare(_));
    let is_several = matches!(read, Several(_));
    let raw = "only for .raw files, this one's own header says it";
    let several = "only for TIFF and OME-Zarr";
    for (key, given, is_wanted, why) in [
        ("dims", overrides.dims.is_some(), is_bare, raw),
        ("type", overrides.voxel_type.is_some(), is_bare, raw),
        ("endian", overrides.endian.is_some(), is_bare, raw),
        ("channel", overrides.channel.is_some(), is_several, several),
        ("time", overrides.time.is_some(), is_several, several),
        ("level", overrides.level.is_some(), is_several, several),
    ] {
        if given && !is_wanted {
            return Err(format!("`{key}` is {why}; leave `{key}` out"));
        }
    }
    Ok(())
}

/// The extensions of what is read: ".nrrd, .nhdr or .raw".
fn readable() -> String {
    let read = FORMATS
        .iter()
        .filter(|(_, _, read)| !matches!(read, Refused(_)));
    let mut names: Vec<&str> = read.flat_map(|(_, ends, _)| *ends).copied().collect();
    let last = names.pop().unwrap_or_default();
    format!("{} or {last}", names.join(", "))
}
