//! NIfTI-1 and NIfTI-2 in one file (`.nii`, `.nii.gz`): <https://nifti.nimh.nih.gov/nifti-1>,
//! <https://nifti.nimh.nih.gov/nifti-2>. They have the same contents, the second in wider numbers and at other
//! offsets.
//!
//! Of the header, only the fields below are read: `descrip`, `aux_file` and `intent_name` are free text, where
//! patients' names live.

mod fields;
mod geometry;

use std::path::Path;

use fields::Fields;
use geometry::geometry;

use super::header::{About, Header, first_bytes};
use super::several::{Key, Several};
use crate::scene::volume::overrides::VolumeOverrides;
use crate::scene::volume::parsed::{Keyed, Parsed, unexpected};
use crate::scene::volume::source::file::{Data, Encoding, Part, Start};
use crate::scene::volume::storage::Storage;
use crate::scene::volume::voxel_type::VoxelType;

/// What is wrong with a header or voxels in a file of their own.
pub const HALF: &str = "is half of a .hdr/.img pair, expected one .nii file; join them first, in Python: \
                        `nibabel.save(nibabel.load(\"scan.hdr\"), \"scan.nii\")`";

pub fn read(path: &Path, overrides: &VolumeOverrides) -> Keyed<Header> {
    // Programs that unpack a file do not always rename it.
    let encoding = match first_bytes(path, 2)?[..] {
        [0x1f, 0x8b] => Encoding::Gzip,
        _ => Encoding::Raw,
    };
    let fields = Fields::read(path, encoding)?;
    let (dims, count, several) = dims(&fields)?;
    let mut notes = Vec::new();
    let is_spacing_known = overrides.spacing.is_some();
    let geometry = geometry(&fields, count, is_spacing_known, &mut notes);
    let (slope, intercept) = rescale(&fields);
    let voxel_type = voxel_type(fields.int(fields.places.datatype, 2))?;
    let data = Data {
        path: path.to_path_buf(),
        start: Start::At(0),
        encoding,
        skip: fields.first_voxel()?,
        part: Part::WHOLE,
    };
    let (source, storage) = several.open(data, path, dims, voxel_type, overrides)?;
    Ok(Header {
        dims,
        voxel_type,
        endian: fields.endian,
        geometry,
        slope,
        intercept,
        notes: [storage.notes(), notes].concat(),
        storage: Storage {
            unit: fields.unit(),
            ..storage
        },
        source,
        about: About::default(),
    })
}

/// The sizes, how many of the three the file gives (the others are 1), and what there is beside one volume: the fourth
/// axis is time, and the fifth the components of a vector.
fn dims(fields: &Fields) -> Parsed<([u32; 3], usize, Several)> {
    let (place, width) = fields.places.dim;
    let size = |axis: usize| fields.int(place + width * axis, width);
    let count = size(0);
    if !(1..=7).contains(&count) {
        return Err(unexpected("dim[0]", &count.to_string(), "1 to 7"));
    }
    let mut dims = [1; 3];
    let mut several = Several::default();
    for axis in 1..=count as usize {
        let wrong =
            |expected| unexpected(&format!("dim[{axis}]"), &size(axis).to_string(), expected);
        let found = u32::try_from(size(axis)).ok().filter(|size| *size > 0);
        let found = found.ok_or_else(|| wrong("1 or more"))?;
        match (axis, found) {
            (1..=3, _) => dims[axis - 1] = found,
            (_, 1) => {}
            (4, _) => several.beyond.push((Key::Time, found)),
            (5, _) => several.beyond.push((Key::Channel, found)),
            _ => {
                return Err(wrong(
                    "1: of axes beyond space, only time and one more are read",
                ));
            }
        }
    }
    Ok((dims, count as usize, several))
}

fn voxel_type(code: i64) -> Parsed<VoxelType> {
    Ok(match code {
        2 => VoxelType::U8,
        4 => VoxelType::I16,
        8 => VoxelType::I32,
        16 => VoxelType::F32,
        64 => VoxelType::F64,
        256 => VoxelType::I8,
        512 => VoxelType::U16,
        768 => VoxelType::U32,
        1024 => VoxelType::I64,
        1280 => VoxelType::U64,
        128 | 2304 => {
            return Err(
                "its voxels are colours (RGB), expected one number each; in Python, one of them is \
                 `numpy.asarray(nibabel.load(\"scan.nii\").dataobj)[\"R\"]`"
                    .into(),
            );
        }
        32 | 1792 | 2048 => {
            return Err(
                "its voxels are complex numbers, expected real ones; in Python, their size is \
                 `numpy.abs(numpy.asarray(nibabel.load(\"scan.nii\").dataobj))`"
                    .into(),
            );
        }
        _ => {
            let expected = "2 or 256 (8 bits), 4 or 512 (16), 8 or 768 (32), 1024 or 1280 (64), 16 (float) or 64 \
                 (double)";
            return Err(unexpected("datatype", &code.to_string(), expected));
        }
    })
}

/// A slope of 0 means that there is no rescaling.
fn rescale(fields: &Fields) -> (f64, f64) {
    let [slope, intercept] =
        [fields.places.scl_slope, fields.places.scl_inter].map(|offset| fields.float(offset));
    if slope == 0.0 || !slope.is_finite() {
        return (1.0, 0.0);
    }
    (
        slope,
        if intercept.is_finite() {
            intercept
        } else {
            0.0
        },
    )
}
