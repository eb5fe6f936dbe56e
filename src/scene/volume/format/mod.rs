//! The file formats, and how each is recognised by a file's name or a folder's content.
//!
//! A format is one module, which makes a [`Header`] of a file, and one line in [`FORMATS`] or in those of
//! [`folder`]. Voxels that do not lie in one file, plain or deflated, come with a
//! [`Source`](super::source::Source) of their own.

mod dicom;
mod folder;
pub mod header;
mod metaimage;
mod nifti;
mod npy;
mod nrrd;
mod raw;
mod several;
mod tiff;
mod vdb;
mod zarr;

use std::path::Path;

use super::overrides::VolumeOverrides;
use super::parsed::{Fault, Keyed, Parsed};
use super::series::{Preview, Series};
use header::Header;

enum Read {
    /// The file describes its voxels.
    Described(fn(&Path) -> Parsed<Header>),
    /// The file may hold several channels and times, of which the user picks one.
    Several(fn(&Path, &VolumeOverrides) -> Keyed<Header>),
    /// It may also hold several resolutions.
    Leveled(fn(&Path, &VolumeOverrides) -> Keyed<Header>),
    /// The file may hold several volumes; the second function lists them, and the third does so with pictures.
    Listed(
        fn(&Path, &VolumeOverrides) -> Keyed<Header>,
        fn(&Path) -> Parsed<Vec<Series>>,
        fn(&Path) -> Parsed<Vec<Preview>>,
    ),
    /// The user describes the voxels, which the file does not.
    Undescribed(fn(&Path, &VolumeOverrides) -> Keyed<Header>),
}

use Read::*;

/// The keys that describe voxels where no header does.
const DESCRIBING_KEYS: [&str; 3] = ["dims", "type", "endian"];

impl Read {
    /// The keys of the user that formats of this kind use, and not all others do.
    fn keys(&self) -> &'static [&'static str] {
        match self {
            Described(_) => &[],
            Several(_) => &["channel", "time"],
            Leveled(_) => &["channel", "time", "level"],
            Listed(..) => &["series", "fill_gaps"],
            Undescribed(_) => &DESCRIBING_KEYS,
        }
    }
}

/// Files of this format may have any name.
const DICOM: (&str, Read) = ("DICOM", Listed(dicom::read, dicom::series, dicom::previews));

/// Each format with the endings of its files' names, in lower case.
const FORMATS: [(&str, &[&str], Read); 8] = [
    ("NRRD", &[".nrrd", ".nhdr"], Several(nrrd::read)),
    ("MetaImage", &[".mha", ".mhd"], Several(metaimage::read)),
    ("NIfTI", &[".nii", ".nii.gz"], Several(nifti::read)),
    ("NumPy", &[".npy"], Described(npy::read)),
    (
        "TIFF",
        &[".tif", ".tiff", ".btf", ".tf2", ".tf8"],
        Leveled(tiff::read),
    ),
    ("raw", &[".raw"], Undescribed(raw::read)),
    ("OpenVDB", &[".vdb"], Several(vdb::read)),
    (DICOM.0, &[".dcm", ".dicom", ".ima", "dicomdir"], DICOM.1),
];

pub(super) fn read(path: &Path, overrides: &VolumeOverrides) -> Keyed<Header> {
    if path.to_string_lossy().contains("://") {
        return Err(
            "is an address on the network, expected a file or folder on this machine; download it \
             first, an OME-Zarr with `ome_zarr download`"
                .into(),
        );
    }
    let (name, read) = format_of(path)?;
    check_keys(read, overrides)?;
    let mut header = match read {
        Described(read) => read(path)?,
        Several(read) | Leveled(read) | Listed(read, ..) | Undescribed(read) => {
            read(path, overrides)?
        }
    };
    header.storage.format = name;
    Ok(header)
}

/// The volumes in a file or folder whose format may hold several; none for other formats.
pub(super) fn series(path: &Path) -> Parsed<Vec<Series>> {
    match format_of(path)?.1 {
        Listed(_, series, _) => series(path),
        _ => Ok(Vec::new()),
    }
}

/// The volumes of a file or folder with pictures, if there are several to choose from.
pub(super) fn previews(path: &Path) -> Parsed<Vec<Preview>> {
    match format_of(path)?.1 {
        Listed(_, _, previews) => previews(path),
        _ => Ok(Vec::new()),
    }
}

fn format_of(path: &Path) -> Parsed<(&'static str, &'static Read)> {
    if path.is_dir() {
        folder::format_of(path)
    } else {
        file(path)
    }
}

/// The format of a file by its name, in lower case.
fn named(name: &str) -> Option<&'static (&'static str, &'static [&'static str], Read)> {
    let is_named = |end: &&str| name.ends_with(*end);
    FORMATS
        .iter()
        .find(|(_, ends, _)| ends.iter().any(is_named))
}

/// How files of a pair end.
const HALVES: [&str; 4] = [".hdr", ".img", ".hdr.gz", ".img.gz"];

fn file(path: &Path) -> Parsed<(&'static str, &'static Read)> {
    let name = path.file_name().unwrap_or_default().to_string_lossy();
    let name = name.to_lowercase();
    match named(&name) {
        Some((name, _, read)) => Ok((name, read)),
        // Many files of DICOM have no extension, or a number in its place.
        None if dicom::is_dicom(path) => Ok((DICOM.0, &DICOM.1)),
        None if name.ends_with(".toml") => Err(
            "is a scene, expected a volume: `isolume scene` prints all that a scene says, `isolume plan` what it takes"
                .into(),
        ),
        None if HALVES.iter().any(|end| name.ends_with(end)) => Err(nifti::HALF.into()),
        None => Err(format!(
            "has an unknown extension, expected {}, or a folder",
            readable()
        )),
    }
}

/// Fails for a key of the user that the format does not use.
fn check_keys(read: &Read, overrides: &VolumeOverrides) -> Keyed<()> {
    for (key, is_given) in [
        ("dims", overrides.dims.is_some()),
        ("type", overrides.voxel_type.is_some()),
        ("endian", overrides.endian.is_some()),
        // A file with one channel, time and level has number 0 of each, so that it may be given for any file.
        ("channel", overrides.channel > Some(0)),
        ("time", overrides.time > Some(0)),
        ("level", overrides.level > Some(0)),
        ("series", overrides.series.is_some()),
        ("fill_gaps", overrides.fill_gaps),
    ] {
        if is_given && !read.keys().contains(&key) {
            let users = users(key);
            let instead = if key == "time" && read.keys().contains(&"series") {
                "; in DICOM each time is a volume of its own, which `series` picks"
            } else {
                ""
            };
            let problem = format!("`{key}` is only for {users}{instead}; leave `{key}` out");
            return Err(Fault::of(key, problem));
        }
    }
    Ok(())
}

/// The formats that use a key, for a message.
fn users(key: &str) -> String {
    if DESCRIBING_KEYS.contains(&key) {
        return ".raw files, this one's own header says it".into();
    }
    let files = FORMATS.iter().map(|(name, _, read)| (*name, read));
    let mut names: Vec<&str> = Vec::new();
    for (name, read) in files.chain(folder::formats()) {
        // A folder of TIFF pages is TIFF, too.
        let is_named = names.iter().any(|known| name.starts_with(known));
        if read.keys().contains(&key) && !is_named {
            names.push(name);
        }
    }
    enumerated(names, "and")
}

/// The extensions of the formats that are read: ".nrrd, .nhdr or .raw".
fn readable() -> String {
    let names = FORMATS.iter().flat_map(|(_, ends, _)| *ends);
    enumerated(names.copied().collect(), "or")
}

/// Names as a sentence lists them: "NRRD, TIFF and OpenVDB".
fn enumerated(mut names: Vec<&str>, conjunction: &str) -> String {
    let last = names.pop().unwrap_or_default();
    match names.len() {
        0 => last.to_string(),
        _ => format!("{} {conjunction} {last}", names.join(", ")),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_key_names_the_formats_that_use_it() {
        let several = "NRRD, MetaImage, NIfTI, TIFF, OpenVDB and OME-Zarr";
        for (key, expected) in [
            ("endian", ".raw files, this one's own header says it"),
            ("channel", several),
            ("time", several),
            ("level", "TIFF and OME-Zarr"),
            ("series", "DICOM"),
            ("fill_gaps", "DICOM"),
        ] {
            assert_eq!(users(key), expected, "{key}");
        }
    }
}
