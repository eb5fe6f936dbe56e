//! NIfTI-1 and NIfTI-2 in one file (`.nii`, `.nii.gz`): <https://nifti.nimh.nih.gov/nifti-1>,
//! <https://nifti.nimh.nih.gov/nifti-2>. They have the same contents, the second in wider numbers and at other
//! offsets.
//!
//! Of the header, only the fields below are read: `descrip`, `aux_file` and `intent_name` are free text, where
//! patients' names live.

use std::io::{self, ErrorKind, Read};
use std::path::Path;

use super::header::{About, Header, first_bytes, unexpected};
use super::several::{Key, Several};
use crate::regular_file::open_file;
use crate::scene::volume::orientation::{Axes, Coordinates, Orientation};
use crate::scene::volume::overrides::VolumeOverrides;
use crate::scene::volume::parsed::{Keyed, Parsed};
use crate::scene::volume::source::file::{Data, Encoding, Part, Start};
use crate::scene::volume::source::gzip::Members;
use crate::scene::volume::storage::Storage;
use crate::scene::volume::voxel_type::{Endian, VoxelType};

/// The offsets of the fields in a version of the format, and their widths.
#[derive(Debug, PartialEq, Eq)]
struct Places {
    /// Bytes of the header, which the header's first number states.
    size: usize,
    magic: usize,
    /// The magic word of files that also hold the voxels.
    magic_word: &'static [u8],
    /// Sizes, and bytes of each.
    dim: (usize, usize),
    datatype: usize,
    pixdim: usize,
    vox_offset: usize,
    scl_slope: usize,
    scl_inter: usize,
    qform_code: usize,
    sform_code: usize,
    quatern: usize,
    srow: usize,
    xyzt_units: usize,
    /// Bytes of a floating-point number.
    real: usize,
}

const NIFTI_1: Places = Places {
    size: 348,
    magic: 344,
    magic_word: b"n+1\0",
    dim: (40, 2),
    datatype: 70,
    pixdim: 76,
    vox_offset: 108,
    scl_slope: 112,
    scl_inter: 116,
    qform_code: 252,
    sform_code: 254,
    quatern: 256,
    srow: 280,
    xyzt_units: 123,
    real: 4,
};

const NIFTI_2: Places = Places {
    size: 540,
    magic: 4,
    magic_word: b"n+2\0\r\n\x1a\n",
    dim: (16, 8),
    datatype: 12,
    pixdim: 104,
    vox_offset: 168,
    scl_slope: 176,
    scl_inter: 184,
    qform_code: 344,
    sform_code: 348,
    quatern: 352,
    srow: 400,
    xyzt_units: 500,
    real: 8,
};

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

struct Fields {
    bytes: Vec<u8>,
    endian: Endian,
    places: &'static Places,
}

/// Why the header of so many bytes could not be read.
fn unread(size: usize, error: io::Error) -> String {
    match error.kind() {
        ErrorKind::UnexpectedEof => format!("it ends within the NIfTI header of {size} bytes"),
        _ => format!("its NIfTI header cannot be read: {error}"),
    }
}

impl Fields {
    fn read(path: &Path, encoding: Encoding) -> Parsed<Fields> {
        let (file, _) = open_file(path)?;
        let mut file: Box<dyn Read> = match encoding {
            Encoding::Raw => Box::new(file),
            _ => Box::new(Members::new(file)),
        };
        let mut bytes = vec![0; NIFTI_1.size];
        file.read_exact(&mut bytes)
            .map_err(|e| unread(NIFTI_1.size, e))?;
        let (endian, places) = match bytes[..4] {
            [0x5c, 1, 0, 0] => (Endian::Little, &NIFTI_1),
            [0, 0, 1, 0x5c] => (Endian::Big, &NIFTI_1),
            [0x1c, 2, 0, 0] => (Endian::Little, &NIFTI_2),
            [0, 0, 2, 0x1c] => (Endian::Big, &NIFTI_2),
            _ => {
                return Err(format!(
                    "starts neither with {} nor with {}, so it is no NIfTI file",
                    NIFTI_1.size, NIFTI_2.size
                ));
            }
        };
        let begin = bytes.len();
        bytes.resize(places.size, 0);
        file.read_exact(&mut bytes[begin..])
            .map_err(|e| unread(places.size, e))?;
        match &bytes[places.magic..] {
            magic if magic.starts_with(places.magic_word) => Ok(Fields {
                bytes,
                endian,
                places,
            }),
            [b'n', b'i', b'1' | b'2', 0, ..] => Err(HALF.into()),
            _ => Err(format!(
                "has no `n+1` or `n+2` at byte {}, so it is no NIfTI file",
                places.magic
            )),
        }
    }

    /// An integer of `size` bytes.
    fn int(&self, offset: usize, size: usize) -> i64 {
        let number = self.endian.number(&self.bytes[offset..offset + size]);
        let unused = 64 - 8 * size;
        (number << unused) as i64 >> unused
    }

    /// A field with a code of the format.
    fn code(&self, offset: usize) -> i64 {
        self.int(offset, self.places.real / 2)
    }

    fn float(&self, offset: usize) -> f64 {
        let size = self.places.real;
        let bits = self.endian.number(&self.bytes[offset..offset + size]);
        match size {
            4 => f64::from(f32::from_bits(bits as u32)),
            _ => f64::from_bits(bits),
        }
    }

    fn floats<const N: usize>(&self, offset: usize) -> [f64; N] {
        std::array::from_fn(|n| self.float(offset + self.places.real * n))
    }

    /// Bytes of the file before the first voxel.
    fn first_voxel(&self) -> Parsed<u64> {
        let place = self.places.vox_offset;
        let least = self.places.size as u64 + 4;
        // Beyond any file, and small enough to be exact.
        const MOST: f64 = 1e15;
        let offset = match self.places.real {
            4 => self.float(place),
            _ => self.int(place, 8) as f64,
        };
        // Left at 0 it means that the voxels follow the header.
        if offset == 0.0 {
            return Ok(least);
        }
        if offset.fract() == 0.0 && (least as f64..=MOST).contains(&offset) {
            Ok(offset as u64)
        } else {
            let expected = format!("0 or a whole number from {least} to {MOST}");
            Err(unexpected("vox_offset", &offset.to_string(), &expected))
        }
    }

    fn unit(&self) -> Option<String> {
        let unit = match self.bytes[self.unit_place()] & 7 {
            1 => "m",
            2 => "mm",
            3 => "µm",
            _ => return None,
        };
        Some(unit.to_string())
    }

    /// The byte of `xyzt_units` that counts.
    fn unit_place(&self) -> usize {
        match (self.places.real, self.endian) {
            (8, Endian::Big) => self.places.xyzt_units + 3,
            _ => self.places.xyzt_units,
        }
    }
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

/// The affine "sform" if there is one, else the rotation "qform", else nothing but voxel sizes. Where the sform is a
/// registration that shears, the qform beside it is where the scanner saw the voxels.
fn geometry(
    fields: &Fields,
    count: usize,
    is_spacing_known: bool,
    notes: &mut Vec<String>,
) -> Parsed<([f64; 3], Orientation)> {
    let orientation = match (sform(fields), qform(fields)) {
        (Some(Ok(affine)), _) => return Ok(affine),
        (Some(Err(fault)), Some(Ok(orientation))) => {
            notes.push(format!("{fault}; the qform is used instead"));
            orientation
        }
        (Some(Err(fault)), _) => return Err(fault),
        (None, Some(orientation)) => orientation?,
        (None, None) => Orientation::UNKNOWN,
    };
    let (spacing, unknown) = voxel_size(fields, count);
    if !is_spacing_known {
        notes.extend(unknown);
    }
    Ok((spacing, orientation))
}

/// Some programs write an sform of zeros, which is none.
fn sform(fields: &Fields) -> Option<Parsed<([f64; 3], Orientation)>> {
    let places = fields.places;
    let rows: [[f64; 4]; 3] =
        std::array::from_fn(|row| fields.floats(places.srow + 4 * places.real * row));
    (fields.code(places.sform_code) > 0 && rows != [[0.0; 4]; 3]).then(|| {
        let steps = std::array::from_fn(|axis| rows.map(|row| row[axis]));
        Orientation::from_steps(steps, Coordinates::Anatomical(Axes::RAS))
            .map_err(|fault| format!("sform: {fault}"))
    })
}

fn qform(fields: &Fields) -> Option<Parsed<Orientation>> {
    let places = fields.places;
    (fields.code(places.qform_code) > 0).then(|| {
        let [handedness] = fields.floats(places.pixdim);
        let mut directions = rotation(fields.floats(places.quatern));
        if handedness < 0.0 {
            directions[2] = directions[2].map(|x| -x);
        }
        match Orientation::from_steps(directions, Coordinates::Anatomical(Axes::RAS)) {
            Ok((_, orientation)) => Ok(orientation),
            Err(fault) => Err(format!("qform: {fault}")),
        }
    })
}

/// The voxel size by `pixdim`, of which only the amount counts: some programs mark a reversed axis by a sign. With a note for
/// each axis along which it is unknown.
fn voxel_size(fields: &Fields, count: usize) -> ([f64; 3], Vec<String>) {
    let pixdim: [f64; 4] = fields.floats(fields.places.pixdim);
    let mut unknown = Vec::new();
    let spacing = [1, 2, 3].map(|axis| match pixdim[axis].abs() {
        // A 2D image need not say how thick it is.
        _ if axis > count => 1.0,
        0.0 => {
            unknown.push(format!(
                "`pixdim[{axis}]` is 0, and counts as 1; if that is wrong, set volume.spacing"
            ));
            1.0
        }
        size => size,
    });
    (spacing, unknown)
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
