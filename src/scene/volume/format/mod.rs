//! The file formats, and how each is recognised by a file's name or a folder's content.
//!
//! A format is one module, which makes a [`Header`] of a file or a folder, and one entry of [`FORMATS`]. Voxels that do not
//! lie in one file, plain or deflated, come with a [`Source`](super::source::Source) of their own.

mod dicom;
mod folder;
pub mod header;
mod metaimage;
mod nifti;
mod npy;
mod nrrd;
mod raw;
mod several;
mod text;
mod tiff;
mod vdb;
mod zarr;

use std::path::Path;

use super::overrides::VolumeOverrides;
use super::parsed::{Fault, Keyed, Parsed};
use super::series::{Preview, Series};
use header::Header;

/// A format of files or of folders.
struct Format {
    name: &'static str,
    recognised: Recognised,
    /// The keys of the user that it uses, and not all others do.
    keys: &'static [&'static str],
    read: fn(&Path, &VolumeOverrides) -> Keyed<Header>,
    /// How volumes are listed where a file or a folder may hold several.
    listing: Option<Listing>,
}

enum Recognised {
    /// Files whose names end so, in lower case.
    ByName(&'static [&'static str]),
    /// Folders, by what they hold. The first such format in the table reads a folder.
    ByContent(fn(&Path) -> bool),
}

struct Listing {
    series: fn(&Path) -> Parsed<Vec<Series>>,
    /// The volumes with pictures, if there are several to choose from.
    previews: fn(&Path) -> Parsed<Vec<Preview>>,
}

use Recognised::*;

/// The keys that describe voxels where no header does.
const DESCRIBING: &[&str] = &["dims", "type", "endian"];
/// The keys that pick one of a file's volumes of equal size.
const SEVERAL: &[&str] = &["channel", "time"];
/// The keys that pick one of its resolutions as well.
const LEVELED: &[&str] = &["channel", "time", "level"];

/// Files of this format may have any name, and lie in folders within a folder.
const DICOM: Format = Format {
    name: "DICOM",
    recognised: ByName(&[".dcm", ".dicom", ".ima", "dicomdir"]),
    keys: &["series", "fill_gaps"],
    read: dicom::read,
    listing: Some(Listing {
        series: dicom::series,
        previews: dicom::previews,
    }),
};

const FORMATS: [Format; 10] = [
    Format {
        name: "NRRD",
        recognised: ByName(&[".nrrd", ".nhdr"]),
        keys: SEVERAL,
        read: nrrd::read,
        listing: None,
    },
    Format {
        name: "MetaImage",
        recognised: ByName(&[".mha", ".mhd"]),
        keys: SEVERAL,
        read: metaimage::read,
        listing: None,
    },
    Format {
        name: "NIfTI",
        recognised: ByName(&[".nii", ".nii.gz"]),
        keys: SEVERAL,
        read: nifti::read,
        listing: None,
    },
    Format {
        name: "NumPy",
        recognised: ByName(&[".npy"]),
        keys: &[],
        read: |path, _| Ok(npy::read(path)?),
        listing: None,
    },
    Format {
        name: "TIFF",
        recognised: ByName(&[".tif", ".tiff", ".btf", ".tf2", ".tf8"]),
        keys: LEVELED,
        read: tiff::read,
        listing: None,
    },
    Format {
        name: "raw",
        recognised: ByName(&[".raw"]),
        keys: DESCRIBING,
        read: raw::read,
        listing: None,
    },
    Format {
        name: "OpenVDB",
        recognised: ByName(&[".vdb"]),
        keys: SEVERAL,
        read: vdb::read,
        listing: None,
    },
    Format {
        name: "OME-Zarr",
        recognised: ByContent(zarr::is_folder),
        keys: LEVELED,
        read: zarr::read_folder,
        listing: None,
    },
    Format {
        name: "TIFF pages",
        recognised: ByContent(folder::has_pages),
        keys: LEVELED,
        read: tiff::read_folder,
        listing: None,
    },
    DICOM,
];

impl Format {
    /// The endings of its files' names; none if it is one of folders.
    fn endings(&self) -> &'static [&'static str] {
        match self.recognised {
            ByName(endings) => endings,
            ByContent(_) => &[],
        }
    }

    fn is_of_folder(&self, path: &Path) -> bool {
        match self.recognised {
            ByName(_) => false,
            ByContent(is_of) => is_of(path),
        }
    }
}

pub(super) fn read(path: &Path, overrides: &VolumeOverrides) -> Keyed<Header> {
    let format = format_of(path)?;
    check_keys(format, overrides)?;
    let mut header = (format.read)(path, overrides)?;
    header.storage.format = format.name;
    Ok(header)
}

/// The volumes in a file or folder whose format may hold several; none for other formats.
pub(super) fn series(path: &Path) -> Parsed<Vec<Series>> {
    match &format_of(path)?.listing {
        Some(listing) => (listing.series)(path),
        None => Ok(Vec::new()),
    }
}

/// The volumes of a file or folder with pictures, if there are several to choose from.
pub(super) fn previews(path: &Path) -> Parsed<Vec<Preview>> {
    match &format_of(path)?.listing {
        Some(listing) => (listing.previews)(path),
        None => Ok(Vec::new()),
    }
}

fn format_of(path: &Path) -> Parsed<&'static Format> {
    if path.to_string_lossy().contains("://") {
        return Err(
            "is an address on the network, expected a file or folder on this machine; download it \
             first, an OME-Zarr with `ome_zarr download`"
                .into(),
        );
    }
    if path.is_dir() {
        folder::format_of(path)
    } else {
        file(path)
    }
}

/// The format of a file by its name, in lower case.
fn named(name: &str) -> Option<&'static Format> {
    let is_named = |format: &&Format| format.endings().iter().any(|end| name.ends_with(end));
    FORMATS.iter().find(is_named)
}

/// How files of a pair end.
const HALVES: [&str; 4] = [".hdr", ".img", ".hdr.gz", ".img.gz"];

fn file(path: &Path) -> Parsed<&'static Format> {
    let name = path.file_name().unwrap_or_default().to_string_lossy();
    let name = name.to_lowercase();
    match named(&name) {
        Some(format) => Ok(format),
        // Many files of DICOM have no extension, or a number in its place.
        None if dicom::is_dicom(path) => Ok(&DICOM),
        None if name.ends_with(".toml") => Err(
            "is a scene file, expected a volume; `isolume scene` prints a scene in full, and `isolume plan` the GPU memory that it needs"
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
fn check_keys(format: &Format, overrides: &VolumeOverrides) -> Keyed<()> {
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
        if is_given && !format.keys.contains(&key) {
            let users = users(key);
            let instead = if key == "time" && format.keys.contains(&"series") {
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
    if DESCRIBING.contains(&key) {
        return ".raw files, since all others state it themselves".into();
    }
    let mut names: Vec<&str> = Vec::new();
    for format in FORMATS.iter().filter(|format| format.keys.contains(&key)) {
        // A folder of TIFF pages is TIFF, too.
        if !names.iter().any(|known| format.name.starts_with(known)) {
            names.push(format.name);
        }
    }
    enumerated(names, "and")
}

/// The extensions of the formats that are read: ".nrrd, .nhdr or .raw".
fn readable() -> String {
    let endings = FORMATS.iter().flat_map(Format::endings);
    enumerated(endings.copied().collect(), "or")
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
            ("endian", ".raw files, since all others state it themselves"),
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
