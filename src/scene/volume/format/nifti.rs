//! NIfTI-1 in one file (`.nii`, `.nii.gz`): <https://nifti.nimh.nih.gov/nifti-1>.
//!
//! Of the header's 348 bytes, only the fields below are read: `descrip`, `aux_file` and
//! `intent_name` are free text, where patients' names live.

use std::io::Read;
use std::path::Path;

use flate2::read::MultiGzDecoder;

use super::header::{Header, unexpected};
use crate::scene::volume::orientation::{Axes, Frame, Orientation};
use crate::scene::volume::parsed::Parsed;
use crate::scene::volume::source::file::{Data, Encoding, Start, open_file};
use crate::scene::volume::voxel_type::{Endian, VoxelType};

const SIZE: usize = 348;
const DIM: usize = 40;
const DATATYPE: usize = 70;
const PIXDIM: usize = 76;
const VOX_OFFSET: usize = 108;
const SCL_SLOPE: usize = 112;
const SCL_INTER: usize = 116;
const QFORM_CODE: usize = 252;
const SFORM_CODE: usize = 254;
const QUATERN: usize = 256;
const SROW: usize = 280;
const MAGIC: usize = 344;

pub fn read(path: &Path) -> Parsed<Header> {
    let is_packed = path
        .extension()
        .is_some_and(|end| end.eq_ignore_ascii_case("gz"));
    let encoding = match is_packed {
        true => Encoding::Gzip,
        false => Encoding::Raw,
    };
    let fields = Fields::read(path, encoding)?;
    let (dims, count) = dims(&fields)?;
    let (spacing, orientation) = geometry(&fields, count)?;
    let (slope, intercept) = rescale(&fields);
    let voxel_type = voxel_type(fields.int(DATATYPE))?;
    let data = Data {
        path: path.to_path_buf(),
        start: Start::At(0),
        encoding,
        skip: first_voxel(fields.float(VOX_OFFSET))?,
    };
    Ok(Header {
        dims,
        voxel_type,
        endian: fields.endian,
        spacing,
        orientation,
        slope,
        intercept,
        source: data.open(path, dims, voxel_type)?,
    })
}

struct Fields {
    bytes: [u8; SIZE],
    endian: Endian,
}

impl Fields {
    fn read(path: &Path, encoding: Encoding) -> Parsed<Fields> {
        let (mut file, _) = open_file(path)?;
        let mut bytes = [0; SIZE];
        match encoding {
            Encoding::Raw => file.read_exact(&mut bytes),
            _ => MultiGzDecoder::new(file).read_exact(&mut bytes),
        }
        .map_err(|e| format!("cannot read the NIfTI header of {SIZE} bytes: {e}"))?;
        let endian = match bytes[..4] {
            [0x5c, 1, 0, 0] => Endian::Little,
            [0, 0, 1, 0x5c] => Endian::Big,
            [0x1c, 2, 0, 0] | [0, 0, 2, 0x1c] => {
                return Err("is NIfTI-2, expected NIfTI-1; convert it to .nrrd first".into());
            }
            _ => {
                return Err(format!(
                    "does not start with {SIZE}, so it is no NIfTI-1 file"
                ));
            }
        };
        match &bytes[MAGIC..] {
            b"n+1\0" => Ok(Fields { bytes, endian }),
            b"ni1\0" => Err("is half of a .hdr/.img pair, expected one .nii file".into()),
            _ => Err("has no `n+1` at byte 344, so it is no NIfTI-1 file".into()),
        }
    }

    fn int(&self, offset: usize) -> i16 {
        let bytes = [self.bytes[offset], self.bytes[offset + 1]];
        match self.endian {
            Endian::Little => i16::from_le_bytes(bytes),
            Endian::Big => i16::from_be_bytes(bytes),
        }
    }

    fn float(&self, offset: usize) -> f64 {
        let bytes = std::array::from_fn(|n| self.bytes[offset + n]);
        f64::from(match self.endian {
            Endian::Little => f32::from_le_bytes(bytes),
            Endian::Big => f32::from_be_bytes(bytes),
        })
    }

    fn floats<const N: usize>(&self, offset: usize) -> [f64; N] {
        std::array::from_fn(|n| self.float(offset + 4 * n))
    }
}

/// The sizes, and how many of the three the file gives; the others are 1.
fn dims(fields: &Fields) -> Parsed<([u32; 3], usize)> {
    let count = fields.int(DIM);
    if !(1..=7).contains(&count) {
        return Err(unexpected("dim[0]", &count.to_string(), "1 to 7"));
    }
    let size = |axis: usize| fields.int(DIM + 2 * axis);
    let mut dims = [1; 3];
    for axis in 1..=count as usize {
        let name = format!("dim[{axis}]");
        match (size(axis), axis) {
            (size @ 1.., 1..=3) => dims[axis - 1] = size as u32,
            (1, _) => {}
            (size, 1..=3) => return Err(unexpected(&name, &size.to_string(), "1 or more")),
            (size, _) => {
                let expected = "1: one scalar volume; extract the one to render first";
                return Err(unexpected(&name, &size.to_string(), expected));
            }
        }
    }
    Ok((dims, count as usize))
}

fn voxel_type(code: i16) -> Parsed<VoxelType> {
    Ok(match code {
        2 => VoxelType::U8,
        4 => VoxelType::I16,
        8 => VoxelType::I32,
        16 => VoxelType::F32,
        64 => VoxelType::F64,
        256 => VoxelType::I8,
        512 => VoxelType::U16,
        768 => VoxelType::U32,
        _ => {
            let expected =
                "2 or 256 (8 bits), 4 or 512 (16), 8 or 768 (32), 16 (float) or 64 (double)";
            return Err(unexpected("datatype", &code.to_string(), expected));
        }
    })
}

fn first_voxel(offset: f64) -> Parsed<u64> {
    // A float: beyond 2^24 it could not even name every byte.
    if offset.fract() == 0.0 && (352.0..=16777216.0).contains(&offset) {
        Ok(offset as u64)
    } else {
        Err(unexpected(
            "vox_offset",
            &offset.to_string(),
            "a whole number from 352 up",
        ))
    }
}

/// A slope of 0 means that there is no rescaling.
fn rescale(fields: &Fields) -> (f64, f64) {
    let [slope, intercept] = [SCL_SLOPE, SCL_INTER].map(|offset| fields.float(offset));
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

/// The affine "sform" if there is one, else the rotation "qform", else nothing but voxel sizes.
fn geometry(fields: &Fields, count: usize) -> Parsed<([f64; 3], Orientation)> {
    let pixdim: [f64; 4] = fields.floats(PIXDIM);
    // A 2D image need not say how thick it is.
    let spacing: [f64; 3] = std::array::from_fn(|a| if a < count { pixdim[a + 1] } else { 1.0 });
    let frame = Frame::Anatomical(Axes::RAS);
    if fields.int(SFORM_CODE) > 0 {
        let rows: [[f64; 4]; 3] = std::array::from_fn(|row| fields.floats(SROW + 16 * row));
        let steps = std::array::from_fn(|axis| rows.map(|row| row[axis]));
        return Orientation::from_steps(steps, frame).map_err(|fault| format!("sform: {fault}"));
    }
    if fields.int(QFORM_CODE) > 0 {
        let mut directions = rotation(fields.floats(QUATERN));
        if pixdim[0] < 0.0 {
            directions[2] = directions[2].map(|x| -x);
        }
        return match Orientation::from_steps(directions, frame) {
            Ok((_, orientation)) => Ok((spacing, orientation)),
            Err(fault) => Err(format!("qform: {fault}")),
        };
    }
    Ok((spacing, Orientation::UNKNOWN))
}

/// The directions of i, j and k from the last three components of a unit quaternion.
fn rotation([b, c, d]: [f64; 3]) -> [[f64; 3]; 3] {
    let a = (1.0 - b * b - c * c - d * d).max(0.0).sqrt();
    // Rounding to float leaves half turns a bit longer than 1.
    let length = (a * a + b * b + c * c + d * d).sqrt();
    let [a, b, c, d] = [a, b, c, d].map(|x| x / length);
    [
        [
            a * a + b * b - c * c - d * d,
            2.0 * (b * c + a * d),
            2.0 * (b * d - a * c),
        ],
        [
            2.0 * (b * c - a * d),
            a * a + c * c - b * b - d * d,
            2.0 * (c * d + a * b),
        ],
        [
            2.0 * (b * d + a * c),
            2.0 * (c * d - a * b),
            a * a + d * d - b * b - c * c,
        ],
    ]
}
