//! Every format gives back the values, shape and orientation that were written to it, and says in
//! one sentence what is wrong with a file that cannot be used.

mod dicom;
mod every_format;
mod folders;
mod imagej;
mod metaimage;
mod nifti;
mod nrrd;
mod refusals;
mod regions;
mod several;
mod tiff;
mod tiff_channels;
mod tiff_pages;
mod tiff_refusals;
mod values;
mod vdb;
mod zarr;
mod zarr_axes;
mod zarr_refusals;

use std::path::{Path, PathBuf};

use crate::volume_files::{Array, gzip, write, zlib};
use isolume::scene::volume::{
    Axes, Endian, StoredType, Volume, VolumeOverrides, VoxelType, Voxels,
};
use tempfile::TempDir;

/// Types that voxels of every format may have.
const TYPES: [VoxelType; 8] = [
    VoxelType::U8,
    VoxelType::I8,
    VoxelType::U16,
    VoxelType::I16,
    VoxelType::U32,
    VoxelType::I32,
    VoxelType::F32,
    VoxelType::F64,
];

/// Types that voxels with a header may also have.
const WIDE_TYPES: [VoxelType; 2] = [VoxelType::U64, VoxelType::I64];

const DIMS: [u32; 3] = [4, 3, 2];

fn folder() -> TempDir {
    tempfile::tempdir().unwrap()
}

fn plain(path: &Path) -> Volume {
    Volume::load(path, &VolumeOverrides::default()).unwrap()
}

fn values(volume: &Volume) -> Vec<f64> {
    let value = |stored: f64| volume.offset + volume.scale * stored;
    match &*volume.voxels().expect("voxels") {
        Voxels::U8(voxels) => voxels.iter().map(|v| value(f64::from(*v))).collect(),
        Voxels::U16(voxels) => voxels.iter().map(|v| value(f64::from(*v))).collect(),
        Voxels::F32(voxels) => voxels.iter().map(|v| value(f64::from(*v))).collect(),
    }
}

/// The message of a file that is no good, which must name the file.
fn refusal(path: &Path, overrides: &VolumeOverrides) -> String {
    match Volume::load(path, overrides) {
        Err(error) if error.is_about_input() => {
            let message = error.to_string();
            let name = path.file_name().unwrap().to_str().unwrap();
            assert!(message.contains(name), "{message}");
            message
        }
        other => panic!("{}: {other:?}", path.display()),
    }
}

fn refuses(name: &str, bytes: impl AsRef<[u8]>, parts: &[&str]) {
    let folder = folder();
    let path = write(folder.path(), name, bytes);
    let message = refusal(&path, &VolumeOverrides::default());
    for part in parts {
        assert!(message.contains(part), "`{part}` is not in: {message}");
    }
}

fn u8s() -> Array {
    Array::new(DIMS, VoxelType::U8, Endian::Little)
}

fn load_bytes(name: &str, bytes: impl AsRef<[u8]>) -> Volume {
    let folder = folder();
    plain(&write(folder.path(), name, bytes))
}

/// Writes each type in each byte order and compares all that is read back.
fn round_trip(write_files: impl Fn(&Path, &Array) -> PathBuf) {
    round_trip_of(TYPES.into_iter().chain(WIDE_TYPES), write_files);
}

/// The same for a format that also has floats of 16 bits.
fn round_trip_with_halves(write_files: impl Fn(&Path, &Array) -> PathBuf) {
    let types = TYPES.into_iter().chain(WIDE_TYPES);
    round_trip_of(types.chain([VoxelType::F16]), write_files);
}

fn round_trip_of(
    types: impl Iterator<Item = VoxelType>,
    write_files: impl Fn(&Path, &Array) -> PathBuf,
) {
    for voxel_type in types {
        for endian in [Endian::Little, Endian::Big] {
            let folder = folder();
            let array = Array::new(DIMS, voxel_type, endian);
            let volume = plain(&write_files(folder.path(), &array));
            let rounded = |value: &f64| match voxel_type {
                VoxelType::F32 | VoxelType::F64 => f64::from(*value as f32),
                _ => *value,
            };
            let expected: Vec<f64> = array.values.iter().map(rounded).collect();
            assert_eq!(values(&volume), expected, "{voxel_type} {endian:?}");
            assert_eq!(volume.dims, DIMS);
            assert_eq!(volume.voxel_type, voxel_type);
            let low = expected.iter().copied().fold(f64::INFINITY, f64::min);
            let high = expected.iter().copied().fold(f64::NEG_INFINITY, f64::max);
            assert_eq!(volume.range, [low, high]);
            let stored = match voxel_type.bytes() {
                1 => StoredType::U8,
                2 if !voxel_type.is_float() => StoredType::U16,
                _ => StoredType::F32,
            };
            assert_eq!(volume.stored, stored, "{voxel_type}");
        }
    }
}

#[test]
fn nrrd_round_trips() {
    round_trip(|folder, array| write(folder, "v.nrrd", array.nrrd("raw", "")));
}

#[test]
fn gzip_nrrd_round_trips() {
    round_trip(|folder, array| write(folder, "v.nrrd", array.nrrd("gzip", "")));
}

#[test]
fn bzip2_nrrd_round_trips() {
    round_trip(|folder, array| write(folder, "v.nrrd", array.nrrd("bzip2", "")));
}

#[test]
fn detached_nrrd_round_trips() {
    round_trip(|folder, array| {
        write(folder, "v.bin", array.bytes());
        write(
            folder,
            "v.nhdr",
            array.nrrd_header("raw", "data file: v.bin\n"),
        )
    });
    round_trip(|folder, array| {
        write(folder, "v.bin.gz", gzip(&array.bytes()));
        write(
            folder,
            "v.nhdr",
            array.nrrd_header("gz", "datafile: v.bin.gz\n\n"),
        )
    });
}

#[test]
fn metaimage_round_trips() {
    round_trip(|folder, array| write(folder, "v.mha", array.mha("")));
    round_trip(|folder, array| write(folder, "v.mha", array.mha("CompressedData = True\n")));
    round_trip(|folder, array| {
        write(folder, "v.bin", array.bytes());
        write(folder, "v.mhd", array.meta_header("", "v.bin"))
    });
    round_trip(|folder, array| {
        write(folder, "v.zraw", zlib(&array.bytes()));
        write(
            folder,
            "v.mhd",
            array.meta_header("CompressedData = True\n", "v.zraw"),
        )
    });
}

#[test]
fn nifti_round_trips() {
    round_trip(|folder, array| write(folder, "v.nii", array.nifti().bytes));
    round_trip(|folder, array| write(folder, "v.nii.gz", gzip(&array.nifti().bytes)));
    round_trip(|folder, array| write(folder, "v.nii", array.nifti_2().bytes));
    round_trip(|folder, array| write(folder, "v.nii.gz", gzip(&array.nifti_2().bytes)));
}

#[test]
fn npy_round_trips() {
    for version in 1..=3 {
        round_trip_with_halves(|folder, array| write(folder, "v.npy", array.npy(version, false)));
        round_trip_with_halves(|folder, array| write(folder, "v.npy", array.npy(version, true)));
    }
}

#[test]
fn raw_takes_its_shape_from_the_user_or_from_its_name() {
    for voxel_type in TYPES.into_iter().chain([VoxelType::F16]) {
        for endian in [Endian::Little, Endian::Big] {
            let folder = folder();
            let array = Array::new(DIMS, voxel_type, endian);
            let named = write(
                folder.path(),
                &format!("a_b_4x3x2_{voxel_type}.raw"),
                array.bytes(),
            );
            let unnamed = write(folder.path(), "v.raw", array.bytes());
            let mut overrides = VolumeOverrides {
                endian: Some(endian),
                ..Default::default()
            };
            let by_name = Volume::load(&named, &overrides).unwrap();
            overrides.dims = Some(DIMS);
            overrides.voxel_type = Some(voxel_type);
            let by_user = Volume::load(&unnamed, &overrides).unwrap();
            let in_f32 = |value: &f64| f64::from(*value as f32);
            let expected: Vec<f64> = array.values.iter().map(in_f32).collect();
            assert_eq!(values(&by_name), expected);
            assert_eq!(values(&by_user), expected);
            assert_eq!(by_user.dims, DIMS);
        }
    }
    refuses("v.raw", [0; 24], &["size", "`dims`", "_uint16.raw"]);
    refuses("v_4x3x2.raw", [0; 24], &["the type"]);
    refuses(
        "v_4x3x2_uint8.raw",
        [0; 23],
        &["holds 23 bytes, expected 24"],
    );
    refuses(
        "v_4x3x2_uint8.raw",
        [0; 25],
        &["holds 25 bytes, expected 24"],
    );
}

#[test]
fn spacing_comes_from_the_header_or_the_user() {
    let array = u8s();
    let nrrd = load_bytes("v.nrrd", array.nrrd("raw", "spacings: 0.5 2 3e0\n"));
    assert_eq!(nrrd.spacing, [0.5, 2.0, 3.0]);
    assert_eq!(nrrd.extent(), [2.0, 6.0, 6.0]);
    assert_eq!(nrrd.axes, None);
    let mha = load_bytes("v.mha", array.mha("ElementSpacing = 0.5 2 3\n"));
    assert_eq!(mha.spacing, [0.5, 2.0, 3.0]);
    assert_eq!(
        load_bytes("v.nii", array.nifti().bytes).spacing,
        [1.5, 2.0, 2.5]
    );
    assert_eq!(load_bytes("v.npy", array.npy(1, false)).spacing, [1.0; 3]);

    let folder = folder();
    let path = write(
        folder.path(),
        "v.nrrd",
        array.nrrd("raw", "spacings: NaN 1 nan\n"),
    );
    // By NRRD's definition that says that the size is not known.
    let unknown = plain(&path);
    assert_eq!(unknown.spacing, [1.0; 3]);
    assert!(
        unknown.notes[0].contains("NaN means that the size of voxels is not known"),
        "{:?}",
        unknown.notes
    );
    let overrides = VolumeOverrides {
        spacing: Some([1.0, 2.0, 4.0]),
        ..Default::default()
    };
    assert_eq!(
        Volume::load(&path, &overrides).unwrap().spacing,
        [1.0, 2.0, 4.0]
    );
    assert!(Volume::load(&path, &overrides).unwrap().notes.is_empty());
}

#[test]
fn extensions_may_be_in_capitals() {
    assert_eq!(
        values(&load_bytes("V.NRRD", u8s().nrrd("raw", ""))),
        u8s().values
    );
}

#[test]
fn letters_and_types_read_as_they_print() {
    for letters in ["LPS", "RAS", "PIR", "ASL"] {
        assert_eq!(letters.parse::<Axes>().unwrap().to_string(), letters);
    }
    for wrong in ["", "LP", "LLS", "LRS", "LPX", "LPSS"] {
        let message = wrong.parse::<Axes>().unwrap_err().to_string();
        assert!(message.contains("L|R"), "{message}");
    }
    for voxel_type in TYPES.into_iter().chain([VoxelType::F16]) {
        assert_eq!(
            voxel_type.to_string().parse::<VoxelType>().unwrap(),
            voxel_type
        );
    }
    assert!("uint64".parse::<VoxelType>().is_err());
    assert!("middle".parse::<Endian>().is_err());
}
