//! The fields of a header, which both versions of the format have in other places and widths.

use std::io::{self, ErrorKind, Read};
use std::path::Path;

use super::HALF;
use crate::regular_file::open_file;
use crate::scene::volume::parsed::{Parsed, unexpected};
use crate::scene::volume::source::file::Encoding;
use crate::scene::volume::source::gzip::Members;
use crate::scene::volume::voxel_type::Endian;

/// The offsets of the fields in a version of the format, and their widths.
#[derive(Debug, PartialEq, Eq)]
pub struct Places {
    /// Bytes of the header, which the header's first number states.
    size: usize,
    magic: usize,
    /// The magic word of files that also hold the voxels.
    magic_word: &'static [u8],
    /// Sizes, and bytes of each.
    pub dim: (usize, usize),
    pub datatype: usize,
    pub pixdim: usize,
    vox_offset: usize,
    pub scl_slope: usize,
    pub scl_inter: usize,
    pub qform_code: usize,
    pub sform_code: usize,
    pub quatern: usize,
    pub srow: usize,
    xyzt_units: usize,
    /// Bytes of a floating-point number.
    pub real: usize,
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

/// A header's bytes, and how to read them.
pub struct Fields {
    bytes: Vec<u8>,
    pub endian: Endian,
    pub places: &'static Places,
}

/// Why the header of so many bytes could not be read.
fn unread(size: usize, error: io::Error) -> String {
    match error.kind() {
        ErrorKind::UnexpectedEof => format!("it ends within the NIfTI header of {size} bytes"),
        _ => format!("its NIfTI header cannot be read: {error}"),
    }
}

impl Fields {
    pub fn read(path: &Path, encoding: Encoding) -> Parsed<Fields> {
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
    pub fn int(&self, offset: usize, size: usize) -> i64 {
        let number = self.endian.number(&self.bytes[offset..offset + size]);
        let unused = 64 - 8 * size;
        (number << unused) as i64 >> unused
    }

    /// A field with a code of the format.
    pub fn code(&self, offset: usize) -> i64 {
        self.int(offset, self.places.real / 2)
    }

    pub fn float(&self, offset: usize) -> f64 {
        let size = self.places.real;
        let bits = self.endian.number(&self.bytes[offset..offset + size]);
        match size {
            4 => f64::from(f32::from_bits(bits as u32)),
            _ => f64::from_bits(bits),
        }
    }

    pub fn floats<const N: usize>(&self, offset: usize) -> [f64; N] {
        std::array::from_fn(|n| self.float(offset + self.places.real * n))
    }

    /// Bytes of the file before the first voxel.
    pub fn first_voxel(&self) -> Parsed<u64> {
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

    pub fn unit(&self) -> Option<String> {
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
