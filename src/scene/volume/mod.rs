//! A volume in host memory: voxels in a width that the GPU can hold, and what they mean.
//!
//! Loading has three steps, each in its own place: a format's module ([`nrrd`], [`metaimage`],
//! [`nifti`], [`npy`], [`raw`]) parses a header, [`source`] opens the voxels it points to, and
//! [`decode`] makes a [`Volume`] of them, the same way for every format.

mod decode;
mod header;
pub mod histogram;
mod metaimage;
mod nifti;
mod npy;
mod nrrd;
mod orientation;
mod raw;
mod reading;
mod region;
mod source;

use std::fmt;
use std::path::Path;
use std::str::FromStr;
use std::sync::OnceLock;

use crate::error::{Error, Result};
use header::{Encoding, Header, Parsed};
pub use histogram::Histogram;
pub use orientation::{Anatomical, Axes};
pub use reading::Reading;

/// Voxel (i, j, k) sits at the cell centre (i+½, j+½, k+½)·spacing from the box's low corner.
#[derive(Debug, Clone)]
pub struct Volume {
    /// Voxels along x (fastest), y and z; each ≥ 1.
    pub dims: [u32; 3],
    /// World units along x, y and z; each > 0.
    pub spacing: [f64; 3],
    /// Stored values; a voxel's value is `offset + scale·stored`.
    pub voxels: Voxels,
    /// > 0, so that stored values and values have the same order.
    pub scale: f64,
    pub offset: f64,
    /// Smallest and largest value present.
    pub range: [f64; 2],
    /// Where i, j and k grow, if the header or the user says so.
    pub axes: Option<Axes>,
    /// The file's own type.
    pub voxel_type: VoxelType,
    /// What the user should know about the loading: one sentence each.
    pub notes: Vec<String>,
    /// What `render::macrocell_ranges` found; the voxels do not change after that.
    pub macrocell_ranges: OnceLock<Vec<[f32; 2]>>,
}

/// 8 and 16 bits stay what they are (signed ones shifted by half their range into `offset`);
/// everything else is f32.
#[derive(Debug, Clone, PartialEq)]
pub enum Voxels {
    U8(Vec<u8>),
    U16(Vec<u16>),
    F32(Vec<f32>),
}

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum VoxelType {
    U8,
    I8,
    U16,
    I16,
    U32,
    I32,
    F32,
    F64,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Endian {
    Little,
    Big,
}

/// What the user says about a file; it counts more than what the file says.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct VolumeOverrides {
    /// Raw files only, x fastest.
    pub dims: Option<[u32; 3]>,
    /// Raw files only.
    pub voxel_type: Option<VoxelType>,
    /// Raw files only; little if absent.
    pub endian: Option<Endian>,
    pub spacing: Option<[f64; 3]>,
    /// Where the file's i, j and k grow: left-handed ones are reversed like a header's.
    pub axes: Option<Axes>,
    /// The file's voxels [low, high) along i, j and k; only these are kept.
    pub crop: Option<[[u32; 3]; 2]>,
}

impl Volume {
    /// Reads a volume of any format, told by the file's name.
    pub fn load(path: &Path, overrides: &VolumeOverrides) -> Result<Volume> {
        Volume::load_watched(path, overrides, &Reading::default())
    }

    /// The same while somebody watches.
    pub fn load_watched(
        path: &Path,
        overrides: &VolumeOverrides,
        reading: &Reading,
    ) -> Result<Volume> {
        let header = read_header(path, overrides)
            .map_err(|fault| Error::input(format!("{}: {fault}", path.display())))?;
        decode::decode(path, &header, overrides, reading)
    }

    /// A volume made in memory; its values are the voxels as they are.
    pub fn from_values(dims: [u32; 3], spacing: [f64; 3], voxels: Voxels) -> Result<Volume> {
        decode::from_values(dims, spacing, voxels)
    }

    /// The box's side lengths in world units.
    pub fn extent(&self) -> [f64; 3] {
        std::array::from_fn(|a| self.dims[a] as f64 * self.spacing[a])
    }
}

fn read_header(path: &Path, overrides: &VolumeOverrides) -> Parsed<Header> {
    if path.is_dir() {
        return Err(
            "is a folder, expected one file; convert a DICOM series first: \
                    `dcm2niix -z y -o OUT FOLDER`"
                .into(),
        );
    }
    let name = path.file_name().unwrap_or_default().to_string_lossy();
    let name = name.to_lowercase();
    let is = |endings: &[&str]| endings.iter().any(|ending| name.ends_with(ending));
    if is(&[".raw"]) {
        return raw::read(path, overrides);
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
    if is(&[".nrrd", ".nhdr"]) {
        nrrd::read(path)
    } else if is(&[".mha", ".mhd"]) {
        metaimage::read(path)
    } else if is(&[".nii"]) {
        nifti::read(path, Encoding::Raw)
    } else if is(&[".nii.gz"]) {
        nifti::read(path, Encoding::Gzip)
    } else if is(&[".npy"]) {
        npy::read(path)
    } else if is(&[".dcm", ".dicom"]) {
        Err(
            "is DICOM, which is not read directly; convert its series first: \
             `dcm2niix -z y -o OUT FOLDER`"
                .into(),
        )
    } else if is(&[".tif", ".tiff"]) {
        Err(
            "is TIFF, which is not read directly; convert it first, with SimpleITK for Python: \
             `WriteImage(ReadImage(\"stack.tif\"), \"stack.nrrd\")`"
                .into(),
        )
    } else {
        Err(
            "has an unknown extension, expected .nrrd, .nhdr, .mha, .mhd, .nii, .nii.gz, .npy or \
             .raw"
                .into(),
        )
    }
}

impl Voxels {
    pub fn len(&self) -> usize {
        match self {
            Voxels::U8(voxels) => voxels.len(),
            Voxels::U16(voxels) => voxels.len(),
            Voxels::F32(voxels) => voxels.len(),
        }
    }

    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }
}

impl VoxelType {
    const NAMES: [(VoxelType, &str); 8] = [
        (VoxelType::U8, "uint8"),
        (VoxelType::I8, "int8"),
        (VoxelType::U16, "uint16"),
        (VoxelType::I16, "int16"),
        (VoxelType::U32, "uint32"),
        (VoxelType::I32, "int32"),
        (VoxelType::F32, "float32"),
        (VoxelType::F64, "float64"),
    ];

    /// The size of a voxel in the file.
    pub fn bytes(self) -> usize {
        match self {
            VoxelType::U8 | VoxelType::I8 => 1,
            VoxelType::U16 | VoxelType::I16 => 2,
            VoxelType::U32 | VoxelType::I32 | VoxelType::F32 => 4,
            VoxelType::F64 => 8,
        }
    }
}

impl fmt::Display for VoxelType {
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        f.write_str(VoxelType::NAMES[*self as usize].1)
    }
}

impl FromStr for VoxelType {
    type Err = Error;

    fn from_str(text: &str) -> Result<VoxelType> {
        let found = VoxelType::NAMES.iter().find(|(_, name)| *name == text);
        found.map(|(voxel_type, _)| *voxel_type).ok_or_else(|| {
            let names = VoxelType::NAMES.map(|(_, name)| name).join(", ");
            Error::input(format!("expected one of {names}"))
        })
    }
}

impl FromStr for Endian {
    type Err = Error;

    fn from_str(text: &str) -> Result<Endian> {
        match text {
            "little" => Ok(Endian::Little),
            "big" => Ok(Endian::Big),
            _ => Err(Error::input("expected \"little\" or \"big\"")),
        }
    }
}
