//! Files of each format that is a single file, from which mutations begin.

use fastrand::Rng;
use isolume::scene::volume::{Endian, VoxelType};

use crate::dicom_files::{self, Pixels, Syntax};
use crate::dicom_scan::{COLUMNS, Scan};
use crate::volume_files::{Array, gzip};

pub struct Seed {
    pub name: &'static str,
    pub bytes: Vec<u8>,
    /// Mutated first, compressed afterwards.
    pub packed_later: bool,
}

pub fn seeds() -> Vec<Seed> {
    let small = Array::new([4, 3, 2], VoxelType::I16, Endian::Big);
    let floats = Array::new([3, 2, 2], VoxelType::F32, Endian::Little);
    // Incompressible, so that changed sizes can promise a megabyte within the limits of deflate.
    let mut noise = Array::new([16, 16, 16], VoxelType::U8, Endian::Little);
    let mut rng = Rng::with_seed(1);
    noise
        .values
        .iter_mut()
        .for_each(|value| *value = f64::from(rng.u8(..)));

    // Longer than the decoder's buffer, so that voxels are stored before the file is found too short.
    let mut large = Array::new([96, 64, 50], VoxelType::U8, Endian::Little);
    large
        .values
        .iter_mut()
        .for_each(|value| *value = f64::from(rng.u8(..)));

    let oriented = "space: LPS\nspace directions: (1,0,0) (0,2,0) (0,0,-3)\nkey:=value\n";
    let matrix = "TransformMatrix = 1 0 0 0 1 0 0 0 1\nElementSpacing = 1 2 3\n";
    let packed = format!("CompressedData = True\n{matrix}");
    let mut nifti = floats.nifti();
    nifti.int16(252, 1);
    nifti.int16(254, 1);
    nifti.floats(280, &[1., 0., 0., 0., 0., 2., 0., 0., 0., 0., 3., 0.]);
    let seed = |name, bytes| Seed {
        name,
        bytes,
        packed_later: false,
    };
    let scan = Scan::ct();
    let of_pixels = |syntax, codestream: &[u8]| {
        let pixels = [codestream.to_vec()];
        dicom_files::file(&scan.header(0), syntax, Pixels::Packed(&pixels), COLUMNS)
    };
    let jpeg_ls = of_pixels(
        Syntax::JpegLs,
        include_bytes!("../support/dicom/slice0.jls"),
    );
    let jpeg_2000 = of_pixels(
        Syntax::Jpeg2000,
        include_bytes!("../support/dicom/slice0.j2k"),
    );
    vec![
        seed("v.nrrd", small.nrrd("raw", oriented)),
        seed(
            "v.nrrd",
            floats.nrrd("gzip", "byte skip: 0\nspacings: 1 1 1\n"),
        ),
        seed("v.nrrd", noise.nrrd("gzip", "spacings: 1 1 1\n")),
        seed(
            "v.nhdr",
            small
                .nrrd_header("raw", "line skip: 1\nbyte skip: 3\ndata file: data.bin\n")
                .into(),
        ),
        seed("v.mha", small.mha(matrix)),
        seed("v.mha", noise.mha(&packed)),
        seed(
            "v.mhd",
            small.meta_header("HeaderSize = 5\n", "data.bin").into(),
        ),
        seed("v.nii", nifti.bytes.clone()),
        seed("v.nii.gz", gzip(&noise.nifti().bytes)),
        Seed {
            name: "v.nii.gz",
            bytes: nifti.bytes,
            packed_later: true,
        },
        seed("v.nrrd", large.nrrd("raw", "spacings: 1 1 1\n")),
        seed("v.nrrd", large.nrrd("gzip", "spacings: 1 1 1\n")),
        seed("v.npy", small.npy(1, false)),
        seed("v.npy", floats.npy(2, true)),
        seed("v_4x3x2_int16.raw", small.bytes()),
        seed("v.dcm", scan.slice_file(0, Syntax::Explicit)),
        seed("v.dcm", scan.enhanced(Syntax::Explicit)),
        seed("v.dcm", scan.enhanced(Syntax::Implicit)),
        seed("v.dcm", scan.enhanced(Syntax::BigEndian)),
        seed("v.dcm", scan.slice_file(0, Syntax::Deflated)),
        seed("v.dcm", scan.enhanced(Syntax::RunLength)),
        seed("v.dcm", scan.enhanced(Syntax::JpegLossless)),
        seed("v.dcm", scan.gated()),
        seed("v.dcm", jpeg_2000),
        seed("v.dcm", jpeg_ls),
    ]
}
