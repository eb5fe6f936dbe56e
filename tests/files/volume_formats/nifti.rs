//! NIfTI-1: orientation and rescaling.

use isolume::scene::volume::{Endian, StoredType, VoxelType};

use crate::volume_files::{Array, gzip};
use crate::volume_formats::{DIMS, load_bytes, refuses, u8s, values};

#[test]
fn nifti_orientation_is_sform_then_qform() {
    let mut file = u8s().nifti();
    assert_eq!(load_bytes("v.nii", &file.bytes).axes, None);

    // A quarter turn about the body's axis: i to the front, j to the left.
    file.int16(252, 1);
    file.floats(256, &[0.0, 0.0, 0.5f32.sqrt()]);
    let volume = load_bytes("v.nii", &file.bytes);
    assert_eq!(volume.axes.unwrap().to_string(), "ALS");
    assert_eq!(volume.spacing, [1.5, 2.0, 2.5]);

    // The same with qfac −1: k is reversed, which makes it left-handed, and is turned back.
    file.floats(76, &[-1.0]);
    let volume = load_bytes("v.nii", &file.bytes);
    assert_eq!(volume.axes.unwrap().to_string(), "ALS");
    assert!(volume.notes[0].contains("ALI became ALS"));
    // What a scene says of the file can be written as the key.
    assert_eq!(volume.file_axes.unwrap().to_string(), "ALI");

    // Radiological storage: i to the left. k is reversed so that left stays left.
    file.int16(254, 2);
    file.floats(
        280,
        &[-3., 0., 0., 90., 0., 4., 0., -126., 0., 0., 5., -72.],
    );
    let volume = load_bytes("v.nii", &file.bytes);
    assert_eq!(volume.axes.unwrap().to_string(), "LAI");
    assert_eq!(volume.spacing, [3.0, 4.0, 5.0]);
}

#[test]
fn nifti_takes_the_qform_where_the_sform_is_zero() {
    let mut file = u8s().nifti();
    file.int16(252, 1);
    file.floats(256, &[0.0, 0.0, 1.0]);
    file.int16(254, 2);
    file.floats(280, &[0.0; 12]);
    let volume = load_bytes("v.nii", file.bytes);
    assert_eq!(volume.axes.unwrap().to_string(), "LPS");
    assert_eq!(volume.spacing, [1.5, 2.0, 2.5]);
}

/// Registrations to an atlas are written as the sform, and the scanner's frame stays in the qform.
#[test]
fn nifti_takes_the_qform_where_the_sform_is_sheared() {
    let mut file = u8s().nifti();
    file.int16(254, 4);
    file.floats(280, &[1., 1., 0., 0., 0., 2., 0., 0., 0., 0., 3., 0.]);
    refuses("v.nii", &file.bytes, &["sform"]);
    file.int16(252, 1);
    file.floats(256, &[0.0, 0.0, 1.0]);
    let volume = load_bytes("v.nii", file.bytes);
    assert_eq!(volume.axes.unwrap().to_string(), "LPS");
    assert_eq!(volume.spacing, [1.5, 2.0, 2.5]);
    let note = "the qform is used instead";
    assert!(volume.notes[0].contains(note), "{:?}", volume.notes);
}

#[test]
fn nifti_voxels_have_a_size_whatever_its_sign() {
    let mut file = u8s().nifti();
    file.floats(80, &[-1.5, 2.0, 0.0]);
    let volume = load_bytes("v.nii", &file.bytes);
    assert_eq!(volume.spacing, [1.5, 2.0, 1.0]);
    let note = "`pixdim[3]` is 0, and counts as 1";
    assert!(volume.notes[0].contains(note), "{:?}", volume.notes);
    file.int16(252, 1);
    let volume = load_bytes("v.nii", &file.bytes);
    assert_eq!(volume.spacing, [1.5, 2.0, 1.0]);
    assert_eq!(volume.axes.unwrap().to_string(), "RAS");
    // Where the sform says how large voxels are, nothing else does.
    file.int16(254, 1);
    file.floats(280, &[3., 0., 0., 0., 0., 4., 0., 0., 0., 0., 5., 0.]);
    let volume = load_bytes("v.nii", &file.bytes);
    assert_eq!(volume.spacing, [3.0, 4.0, 5.0]);
    assert!(volume.notes.is_empty(), "{:?}", volume.notes);
    let mut flat = u8s().nifti();
    flat.int16(40, 2);
    flat.floats(88, &[0.0]);
    assert!(load_bytes("v.nii", flat.bytes).notes.is_empty());
}

#[test]
fn nifti_voxels_follow_the_header_where_nothing_is_said() {
    let (mut narrow, mut wide) = (u8s().nifti(), u8s().nifti_2());
    narrow.floats(108, &[0.0]);
    wide.int64(168, 0);
    for file in [narrow, wide] {
        assert_eq!(values(&load_bytes("v.nii", file.bytes)), u8s().values);
    }
}

#[test]
fn nifti_is_unpacked_by_its_content() {
    let plain = u8s().nifti().bytes;
    assert_eq!(values(&load_bytes("v.nii", gzip(&plain))), u8s().values);
    assert_eq!(values(&load_bytes("v.nii.gz", plain)), u8s().values);
}

#[test]
fn nifti_rescales() {
    let array = Array::new(DIMS, VoxelType::I16, Endian::Big);
    let rescaled = |slope: f32, intercept: f32| {
        let mut file = array.nifti();
        file.floats(112, &[slope, intercept]);
        load_bytes("v.nii", file.bytes)
    };
    let expected = |slope: f64, intercept: f64| -> Vec<f64> {
        let value = |stored: &f64| intercept + slope * stored;
        array.values.iter().map(value).collect()
    };
    let volume = rescaled(0.5, -1024.0);
    assert!(volume.stored == StoredType::U16);
    assert_eq!(values(&volume), expected(0.5, -1024.0));
    assert_eq!(volume.range, [-17408.0, 15359.5]);

    let negative = rescaled(-2.0, 1.0);
    assert!(negative.stored == StoredType::F32);
    assert_eq!((negative.scale, negative.offset), (1.0, 0.0));
    assert_eq!(values(&negative), expected(-2.0, 1.0));

    for none in [0.0, f32::NAN, f32::INFINITY] {
        assert_eq!(values(&rescaled(none, 5.0)), array.values);
    }
    assert_eq!(values(&rescaled(2.0, f32::NAN)), expected(2.0, 0.0));

    let floats = Array::new([2, 1, 1], VoxelType::F32, Endian::Little);
    let floats = Array {
        values: vec![1.0, 2.5],
        ..floats
    };
    let mut file = floats.nifti();
    file.floats(112, &[4.0, 1.0]);
    let volume = load_bytes("v.nii", file.bytes);
    assert_eq!((values(&volume), volume.scale), (vec![5.0, 11.0], 1.0));
}

/// The wider header says what the narrow one does.
#[test]
fn nifti_2_is_nifti_1_in_wider_numbers() {
    for endian in [Endian::Little, Endian::Big] {
        let array = Array::new(DIMS, VoxelType::I16, endian);
        let mut narrow = array.nifti();
        narrow.floats(112, &[2.0, -1.0]);
        narrow.int16(254, 1);
        let rows = [0., -2., 0., 5., 0., 0., 3., 6., 4., 0., 0., 7.];
        narrow.floats(280, &rows);
        narrow.bytes[123] = 3;
        let mut wide = array.nifti_2();
        wide.doubles(176, &[2.0, -1.0]);
        wide.int32(348, 1);
        wide.doubles(400, &rows.map(f64::from));
        wide.int32(500, 3);
        let [narrow, wide] = [narrow, wide].map(|file| load_bytes("v.nii", file.bytes));
        assert_eq!(values(&narrow), values(&wide));
        assert_eq!((narrow.spacing, narrow.axes), (wide.spacing, wide.axes));
        assert_eq!(wide.spacing, [4.0, 2.0, 3.0]);
        assert_eq!(wide.storage.unit.as_deref(), Some("µm"));
        assert_eq!(narrow.storage, wide.storage);

        let mut wide = array.nifti_2();
        wide.int32(344, 1);
        wide.doubles(352, &[0.0, 0.0, 1.0]);
        let volume = load_bytes("v.nii", wide.bytes);
        assert_eq!(volume.axes.unwrap().to_string(), "LPS");
    }
}

#[test]
fn nifti_refuses_what_is_no_scalar_volume() {
    let changed = |offset: usize, value: i16| {
        let mut file = u8s().nifti();
        file.int16(offset, value);
        file.bytes
    };
    let mut series = u8s().nifti();
    series.int16(40, 6);
    assert_eq!(load_bytes("v.nii", &series.bytes).dims, DIMS);
    series.int16(52, 5);
    refuses("v.nii", &series.bytes, &["`dim[6]` is `5`", "expected 1"]);
    series.int16(48, 0);
    refuses("v.nii", series.bytes, &["`dim[4]` is `0`", "1 or more"]);
    refuses("v.nii", changed(40, 9), &["`dim[0]` is `9`"]);
    refuses("v.nii", changed(44, 0), &["`dim[2]` is `0`"]);
    refuses("v.nii", changed(44, -4), &["`dim[2]` is `-4`"]);
    refuses("v.nii", changed(70, 1), &["`datatype` is `1`"]);
    refuses("v.nii", changed(70, 128), &["colours (RGB)"]);
    refuses("v.nii", changed(70, 32), &["complex numbers"]);
    refuses("v.nii", changed(0, 540), &["header of 540 bytes"]);
    refuses("v.nii", changed(344, 0x696e), &[".hdr/.img"]);
    refuses("v.nii", [1; 400], &["no NIfTI file"]);
    refuses(
        "v.nii",
        [0; 40],
        &["it ends within the NIfTI header of 348 bytes"],
    );
    let mut early = u8s().nifti();
    early.floats(108, &[12.0]);
    refuses("v.nii", early.bytes, &["`vox_offset` is `12`"]);
    let mut late = u8s().nifti();
    late.floats(108, &[33554432.0]);
    refuses("v.nii", late.bytes, &["holds 0 bytes of voxels"]);
}

/// Some programs fill the last block of a file with zeros.
#[test]
fn zeros_behind_gzip_are_ignored() {
    let plain = u8s().nifti().bytes;
    let packed = gzip(&plain);
    let (first, second) = plain.split_at(360);
    let members = [gzip(first), gzip(second)].concat();
    for whole in [&packed, &members] {
        let padded = [&whole[..], &[0; 40_000]].concat();
        assert_eq!(values(&load_bytes("v.nii.gz", padded)), u8s().values);
        let more = [&whole[..], &[0; 40_000], b"more"].concat();
        refuses("v.nii.gz", more, &["the file is damaged"]);
    }
}
