//! Writes small volumes in every format, straight from the formats' definitions.

#![allow(dead_code)] // The fuzzer uses less of it than the tests of formats.

use std::io::Write;
use std::path::{Path, PathBuf};

use bzip2::write::BzEncoder;
use flate2::Compression;
use flate2::write::{GzEncoder, ZlibEncoder};
use half::f16;
use isolume::scene::volume::{Endian, VoxelType};

/// One array of voxels, to be dressed as any format.
#[derive(Debug, Clone)]
pub struct Array {
    pub dims: [u32; 3],
    pub voxel_type: VoxelType,
    pub endian: Endian,
    pub values: Vec<f64>,
}

impl Array {
    pub fn new(dims: [u32; 3], voxel_type: VoxelType, endian: Endian) -> Array {
        let count = dims.iter().product::<u32>() as usize;
        let values = (0..count).map(|n| sample(voxel_type, n)).collect();
        Array {
            dims,
            voxel_type,
            endian,
            values,
        }
    }

    /// The voxels as a file holds them.
    pub fn bytes(&self) -> Vec<u8> {
        let little = |value: &f64| match self.voxel_type {
            VoxelType::U8 => (*value as u8).to_le_bytes().to_vec(),
            VoxelType::I8 => (*value as i8).to_le_bytes().to_vec(),
            VoxelType::U16 => (*value as u16).to_le_bytes().to_vec(),
            VoxelType::I16 => (*value as i16).to_le_bytes().to_vec(),
            VoxelType::U32 => (*value as u32).to_le_bytes().to_vec(),
            VoxelType::I32 => (*value as i32).to_le_bytes().to_vec(),
            VoxelType::U64 => (*value as u64).to_le_bytes().to_vec(),
            VoxelType::I64 => (*value as i64).to_le_bytes().to_vec(),
            VoxelType::F16 => f16::from_f64(*value).to_le_bytes().to_vec(),
            VoxelType::F32 => (*value as f32).to_le_bytes().to_vec(),
            VoxelType::F64 => value.to_le_bytes().to_vec(),
        };
        let ordered = |mut bytes: Vec<u8>| {
            if self.endian == Endian::Big {
                bytes.reverse();
            }
            bytes
        };
        self.values.iter().map(little).flat_map(ordered).collect()
    }

    /// A NRRD header without its closing empty line; `more` are further lines.
    pub fn nrrd_header(&self, encoding: &str, more: &str) -> String {
        let [x, y, z] = self.dims;
        let endian = match self.endian {
            Endian::Little => "little",
            Endian::Big => "big",
        };
        let name = match self.voxel_type {
            VoxelType::F16 => panic!("NRRD has no floats of 16 bits"),
            VoxelType::F32 => "float".to_string(),
            VoxelType::F64 => "double".to_string(),
            integer => integer.to_string(),
        };
        format!(
            "NRRD0004\n# comment\ntype: {name}\ndimension: 3\nsizes: {x} {y} {z}\n\
             endian: {endian}\nencoding: {encoding}\n{more}"
        )
    }

    pub fn nrrd(&self, encoding: &str, more: &str) -> Vec<u8> {
        let body = match encoding {
            "gzip" => gzip(&self.bytes()),
            "bzip2" => bzip2(&self.bytes()),
            _ => self.bytes(),
        };
        let header = self.nrrd_header(encoding, more);
        [header.as_bytes(), b"\n", &body].concat()
    }

    /// A MetaImage header up to `ElementDataFile`.
    pub fn meta_header(&self, more: &str, data_file: &str) -> String {
        let [x, y, z] = self.dims;
        let msb = if self.endian == Endian::Big {
            "True"
        } else {
            "False"
        };
        let name = match self.voxel_type {
            VoxelType::U8 => "MET_UCHAR",
            VoxelType::I8 => "MET_CHAR",
            VoxelType::U16 => "MET_USHORT",
            VoxelType::I16 => "MET_SHORT",
            VoxelType::U32 => "MET_UINT",
            VoxelType::I32 => "MET_INT",
            VoxelType::U64 => "MET_ULONG_LONG",
            VoxelType::I64 => "MET_LONG_LONG",
            VoxelType::F16 => panic!("MetaImage has no floats of 16 bits"),
            VoxelType::F32 => "MET_FLOAT",
            VoxelType::F64 => "MET_DOUBLE",
        };
        format!(
            "ObjectType = Image\nNDims = 3\nBinaryData = True\nBinaryDataByteOrderMSB = {msb}\n\
             DimSize = {x} {y} {z}\nElementType = {name}\n{more}ElementDataFile = {data_file}\n"
        )
    }

    pub fn mha(&self, more: &str) -> Vec<u8> {
        let body = if more.contains("CompressedData = True") {
            zlib(&self.bytes())
        } else {
            self.bytes()
        };
        [self.meta_header(more, "LOCAL").as_bytes(), &body].concat()
    }

    /// Voxels 1.5 × 2 × 2.5 apart, no orientation, voxels from byte 352.
    pub fn nifti(&self) -> Nifti {
        let mut file = Nifti {
            bytes: vec![0; 352],
            endian: self.endian,
        };
        file.int32(0, 348);
        file.int16(40, 3);
        for (a, size) in self.dims.iter().enumerate() {
            file.int16(42 + 2 * a, *size as i16);
        }
        for (n, one) in (3..7).map(|n| (n, 1)) {
            file.int16(42 + 2 * n, one);
        }
        let code = match self.voxel_type {
            VoxelType::U8 => 2,
            VoxelType::I16 => 4,
            VoxelType::I32 => 8,
            VoxelType::F16 => panic!("NIfTI has no floats of 16 bits"),
            VoxelType::F32 => 16,
            VoxelType::F64 => 64,
            VoxelType::I8 => 256,
            VoxelType::U16 => 512,
            VoxelType::U32 => 768,
            VoxelType::I64 => 1024,
            VoxelType::U64 => 1280,
        };
        file.int16(70, code);
        file.int16(72, 8 * self.voxel_type.bytes() as i16);
        file.floats(76, &[1.0, 1.5, 2.0, 2.5]);
        file.floats(108, &[352.0]);
        file.bytes[344..348].copy_from_slice(b"n+1\0");
        file.bytes.extend(self.bytes());
        file
    }

    /// The same in the wider header of NIfTI-2, voxels from byte 544.
    pub fn nifti_2(&self) -> Nifti {
        let narrow = self.nifti();
        let mut file = Nifti {
            bytes: vec![0; 544],
            endian: self.endian,
        };
        file.int32(0, 540);
        file.bytes[4..12].copy_from_slice(b"n+2\0\r\n\x1a\n");
        file.bytes[12..16].copy_from_slice(&narrow.bytes[70..74]);
        file.int64(16, 3);
        for (a, size) in self.dims.iter().enumerate() {
            file.int64(24 + 8 * a, (*size).into());
        }
        for n in 3..7 {
            file.int64(24 + 8 * n, 1);
        }
        file.doubles(104, &[1.0, 1.5, 2.0, 2.5]);
        file.int64(168, 544);
        file.bytes.extend(self.bytes());
        file
    }

    pub fn npy(&self, version: u8, fortran: bool) -> Vec<u8> {
        let [x, y, z] = self.dims;
        let shape = if fortran { [x, y, z] } else { [z, y, x] };
        let order = match (self.voxel_type.bytes(), self.endian) {
            (1, _) => '|',
            (_, Endian::Little) => '<',
            (_, Endian::Big) => '>',
        };
        let kind = match self.voxel_type {
            VoxelType::U8 | VoxelType::U16 | VoxelType::U32 | VoxelType::U64 => 'u',
            VoxelType::I8 | VoxelType::I16 | VoxelType::I32 | VoxelType::I64 => 'i',
            VoxelType::F16 | VoxelType::F32 | VoxelType::F64 => 'f',
        };
        let size = self.voxel_type.bytes();
        let fortran = if fortran { "True" } else { "False" };
        let [a, b, c] = shape;
        let text = format!(
            "{{'descr': '{order}{kind}{size}', 'fortran_order': {fortran}, 'shape': ({a}, {b}, {c}), }}   \n"
        );
        let length = match version {
            1 => (text.len() as u16).to_le_bytes().to_vec(),
            _ => (text.len() as u32).to_le_bytes().to_vec(),
        };
        let magic = [0x93, b'N', b'U', b'M', b'P', b'Y', version, 0];
        [&magic[..], &length, text.as_bytes(), &self.bytes()].concat()
    }
}

/// A NIfTI file whose header fields can be set by their offset.
#[derive(Debug, Clone)]
pub struct Nifti {
    pub bytes: Vec<u8>,
    endian: Endian,
}

impl Nifti {
    pub fn int16(&mut self, offset: usize, value: i16) {
        self.put(offset, value.to_le_bytes().to_vec());
    }

    pub fn int32(&mut self, offset: usize, value: i32) {
        self.put(offset, value.to_le_bytes().to_vec());
    }

    pub fn int64(&mut self, offset: usize, value: i64) {
        self.put(offset, value.to_le_bytes().to_vec());
    }

    pub fn doubles(&mut self, offset: usize, values: &[f64]) {
        for (n, value) in values.iter().enumerate() {
            self.put(offset + 8 * n, value.to_le_bytes().to_vec());
        }
    }

    pub fn floats(&mut self, offset: usize, values: &[f32]) {
        for (n, value) in values.iter().enumerate() {
            self.put(offset + 4 * n, value.to_le_bytes().to_vec());
        }
    }

    fn put(&mut self, offset: usize, mut bytes: Vec<u8>) {
        if self.endian == Endian::Big {
            bytes.reverse();
        }
        self.bytes[offset..offset + bytes.len()].copy_from_slice(&bytes);
    }
}

/// Values that a type's conversion could get wrong: its ends, both sides of 0, and a spread.
fn sample(voxel_type: VoxelType, n: usize) -> f64 {
    let (low, high, step): (f64, f64, f64) = match voxel_type {
        VoxelType::U8 => (0.0, 255.0, 1.0),
        VoxelType::I8 => (-128.0, 127.0, 1.0),
        VoxelType::U16 => (0.0, 65535.0, 257.0),
        VoxelType::I16 => (-32768.0, 32767.0, 257.0),
        VoxelType::U32 | VoxelType::U64 => (0.0, 4294967040.0, 65536.0),
        VoxelType::I32 | VoxelType::I64 => (-2147483648.0, 2147483520.0, 65536.0),
        VoxelType::F16 => (-65504.0, 3.25, 0.125),
        VoxelType::F32 | VoxelType::F64 => (-1.5e30, 3.25, 0.125),
    };
    match n {
        0 => low,
        1 => high,
        2 => low.max(0.0),
        3 => (-step).max(low),
        _ => (n % 120) as f64 * step,
    }
}

pub fn gzip(bytes: &[u8]) -> Vec<u8> {
    let mut encoder = GzEncoder::new(Vec::new(), Compression::default());
    encoder.write_all(bytes).unwrap();
    encoder.finish().unwrap()
}

pub fn zlib(bytes: &[u8]) -> Vec<u8> {
    let mut encoder = ZlibEncoder::new(Vec::new(), Compression::default());
    encoder.write_all(bytes).unwrap();
    encoder.finish().unwrap()
}

pub fn bzip2(bytes: &[u8]) -> Vec<u8> {
    let mut encoder = BzEncoder::new(Vec::new(), bzip2::Compression::default());
    encoder.write_all(bytes).unwrap();
    encoder.finish().unwrap()
}

pub fn write(folder: &Path, name: &str, bytes: impl AsRef<[u8]>) -> PathBuf {
    let path = folder.join(name);
    std::fs::write(&path, bytes).unwrap();
    path
}
