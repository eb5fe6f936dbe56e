//! The file formats: which there are, and how each is told by a file's name.
//!
//! A format is one module, which makes a [`Header`] of a file, and one line in [`FORMATS`]. Voxels that
//! do not lie in one file, plain or deflated, come with a [`Source`](super::source::Source) of their own.

pub mod header;
mod metaimage;
mod nifti;
mod npy;
mod nrrd;
mod raw;

use std::path::Path;

use super::overrides::VolumeOverrides;
use super::parsed::Parsed;
use header::Header;

enum Read {
    /// The file says what its voxels are.
    Described(fn(&Path) -> Parsed<Header>),
    /// The user says it.
    Bare(fn(&Path, &VolumeOverrides) -> Parsed<Header>),
    /// The format is known and not read: the sentence says what can be done instead.
    Refused(&'static str),
}

use Read::*;

/// Each with the ends of its files' names, in lower case.
const FORMATS: [(&[&str], Read); 7] = [
    (&[".nrrd", ".nhdr"], Described(nrrd::read)),
    (&[".mha", ".mhd"], Described(metaimage::read)),
    (&[".nii", ".nii.gz"], Described(nifti::read)),
    (&[".npy"], Described(npy::read)),
    (&[".raw"], Bare(raw::read)),
    (
        &[".dcm", ".dicom"],
        Refused(
            "is DICOM, which is not read directly; convert its series first: \
             `dcm2niix -z y -o OUT FOLDER`",
        ),
    ),
    (
        &[".tif", ".tiff"],
        Refused(
            "is TIFF, which is not read directly; convert it first, with SimpleITK for Python: \
             `WriteImage(ReadImage(\"stack.tif\"), \"stack.nrrd\")`",
        ),
    ),
];

pub(super) fn read(path: &Path, overrides: &VolumeOverrides) -> Parsed<Header> {
    if path.is_dir() {
        return Err(
            "is a folder, expected one file; convert a DICOM series first: \
                    `dcm2niix -z y -o OUT FOLDER`"
                .into(),
        );
    }
    let name = path.file_name().unwrap_or_default().to_string_lossy();
    let name = name.to_lowercase();
    let is_named = |end: &&str| name.ends_with(*end);
    let format = FORMATS.iter().find(|(ends, _)| ends.iter().any(is_named));
    let format = format.map(|(_, read)| read);
    if let Some(Bare(read)) = format {
        return read(path, overrides);
    }
    for (key, given) in [
        ("dims", overrides.dims.is_some()),
        ("type", overrides.voxel_type.is_some()),
        ("endian", overrides.endian.is_some()),
    ] {
        if given {
            return Err(format!(
                "`{key}` is only for .raw files, this one's own header says it; leave `{key}` out"
            ));
        }
    }
    match format {
        Some(Described(read)) => read(path),
        Some(Bare(read)) => read(path, overrides),
        Some(Refused(why)) => Err(why.to_string()),
        None => Err(format!("has an unknown extension, expected {}", readable())),
    }
}

/// The extensions of what is read: ".nrrd, .nhdr or .raw".
fn readable() -> String {
    let read = FORMATS
        .iter()
        .filter(|(_, read)| !matches!(read, Refused(_)));
    let mut names: Vec<&str> = read.flat_map(|(ends, _)| *ends).copied().collect();
    let last = names.pop().unwrap_or_default();
    format!("{} or {last}", names.join(", "))
}
