//! What becomes of the values whatever the format: crops, numbers that are none, rounding.

use std::io::{Seek, SeekFrom, Write};

use isolume::scene::volume::{Endian, Volume, VolumeOverrides, VoxelType, Voxels};

use crate::volume_files::{Array, write};
use crate::volume_formats::{folder, load_bytes, refusal, refuses, values};

/// The voxels of a box, taken from the whole.
fn cropped(array: &Array, [low, high]: [[u32; 3]; 2]) -> Vec<f64> {
    let [x, y, _] = array.dims;
    let mut kept = Vec::new();
    for k in low[2]..high[2] {
        for j in low[1]..high[1] {
            for i in low[0]..high[0] {
                kept.push(array.values[((k * y + j) * x + i) as usize]);
            }
        }
    }
    kept
}

#[test]
fn crop_keeps_only_its_voxels() {
    let folder = folder();
    let array = Array::new([5, 4, 3], VoxelType::I16, Endian::Little);
    let paths = [
        write(
            folder.path(),
            "raw.nrrd",
            array.nrrd("raw", "spacings: 1 2 3\n"),
        ),
        write(
            folder.path(),
            "gzip.nrrd",
            array.nrrd("gzip", "spacings: 1 2 3\n"),
        ),
    ];
    for path in &paths {
        for crop in [
            [[0, 0, 0], [5, 4, 3]],
            [[1, 1, 1], [4, 3, 2]],
            [[0, 1, 0], [5, 3, 3]],
            [[0, 0, 1], [5, 4, 3]],
            [[4, 3, 2], [5, 4, 3]],
        ] {
            let overrides = VolumeOverrides {
                crop: Some(crop),
                ..Default::default()
            };
            let volume = Volume::load(path, &overrides).unwrap();
            assert_eq!(values(&volume), cropped(&array, crop), "{crop:?}");
            let size: [f64; 3] = std::array::from_fn(|a| f64::from(crop[1][a] - crop[0][a]));
            assert_eq!(volume.extent(), [size[0], 2.0 * size[1], 3.0 * size[2]]);
        }
        for crop in [
            [[0, 0, 0], [6, 4, 3]],
            [[2, 0, 0], [2, 4, 3]],
            [[3, 0, 0], [2, 4, 3]],
            [[0, 0, u32::MAX], [5, 4, u32::MAX]],
        ] {
            let overrides = VolumeOverrides {
                crop: Some(crop),
                ..Default::default()
            };
            assert!(refusal(path, &overrides).contains("5×4×3"));
        }
    }
}

#[test]
fn crop_counts_the_files_voxels_also_where_the_slowest_axis_is_reversed() {
    let folder = folder();
    let array = Array::new([2, 1, 3], VoxelType::U8, Endian::Little);
    let path = write(folder.path(), "v.nrrd", array.nrrd("raw", ""));
    let overrides = VolumeOverrides {
        axes: Some("LPI".parse().unwrap()),
        crop: Some([[0, 0, 0], [2, 1, 2]]),
        ..Default::default()
    };
    let v = &array.values;
    assert_eq!(
        values(&Volume::load(&path, &overrides).unwrap()),
        [v[2], v[3], v[0], v[1]]
    );
}

#[test]
fn values_that_are_not_finite_become_the_smallest() {
    for voxel_type in [VoxelType::F32, VoxelType::F64] {
        let mut array = Array::new([5, 1, 1], voxel_type, Endian::Little);
        array.values = vec![f64::NAN, 3.0, f64::NEG_INFINITY, -2.0, f64::INFINITY];
        let volume = load_bytes("v.nrrd", array.nrrd("raw", ""));
        assert_eq!(values(&volume), [-2.0, 3.0, -2.0, -2.0, -2.0]);
        assert_eq!(volume.range, [-2.0, 3.0]);
        assert!(
            volume.notes[0].starts_with("3 voxels"),
            "{:?}",
            volume.notes
        );
        array.values = vec![f64::NAN; 5];
        refuses(
            "v.nrrd",
            array.nrrd("raw", ""),
            &["no voxel has a finite value"],
        );
    }
}

/// All that 16 bits can be: those with an exponent of 0 are subnormal, and those with the highest are not finite.
#[test]
fn floats_of_16_bits_are_read_exactly() {
    let number = |bits: u16| {
        let sign = if bits >> 15 == 0 { 1.0 } else { -1.0 };
        let fraction = f64::from(bits & 0x3ff) / 1024.0;
        match i32::from(bits >> 10 & 0x1f) {
            0 => sign * fraction * f64::powi(2.0, -14),
            0x1f => -65504.0,
            exponent => sign * (1.0 + fraction) * f64::powi(2.0, exponent - 15),
        }
    };
    let all = 0..=u16::MAX;
    let expected: Vec<f64> = all.clone().map(number).collect();
    for endian in [Endian::Little, Endian::Big] {
        let bytes = all.clone().flat_map(|bits| match endian {
            Endian::Little => bits.to_le_bytes(),
            Endian::Big => bits.to_be_bytes(),
        });
        let folder = folder();
        let name = "v_64x64x16_float16.raw";
        let path = write(folder.path(), name, bytes.collect::<Vec<u8>>());
        let overrides = VolumeOverrides {
            endian: Some(endian),
            ..Default::default()
        };
        let volume = Volume::load(&path, &overrides).unwrap();
        assert!(values(&volume) == expected, "{endian:?}");
        assert_eq!(volume.range, [-65504.0, 65504.0]);
        let note =
            "2048 voxels are not finite float32 numbers and became the smallest value, -65504";
        assert_eq!(volume.notes, [note]);
    }
}

#[test]
fn rounding_to_float_is_noted() {
    let mut array = Array::new([2, 1, 1], VoxelType::I32, Endian::Little);
    array.values = vec![0.0, 16777217.0];
    let volume = load_bytes("v.nrrd", array.nrrd("raw", ""));
    assert_eq!(values(&volume), [0.0, 16777216.0]);
    assert!(
        volume.notes[0].contains("up to 1.0e0"),
        "{:?}",
        volume.notes
    );
    array.values[1] = 16777216.0;
    assert!(load_bytes("v.nrrd", array.nrrd("raw", "")).notes.is_empty());
}

#[test]
fn integers_of_64_bits_must_fit_32() {
    let ends = [
        (VoxelType::I64, -2147483648.0, 4294967295.0, -2147483649.0),
        (VoxelType::U64, 0.0, 4294967295.0, 4294967296.0),
    ];
    for (voxel_type, low, high, beyond) in ends {
        let mut array = Array::new([300, 20, 70], voxel_type, Endian::Big);
        array.values.fill(low);
        array.values[5] = high;
        let volume = load_bytes("v.nrrd", array.nrrd("raw", ""));
        assert_eq!(volume.range, [low, f64::from(high as f32)]);
        assert_eq!(volume.notes.len(), 1, "{:?}", volume.notes);
        // The first one is named, whichever core comes first.
        array.values[250_000] = beyond;
        array.values[400_000] = 5e9;
        for encoding in ["raw", "gzip"] {
            refuses(
                "v.nrrd",
                array.nrrd(encoding, ""),
                &[
                    &format!("a voxel is {beyond}, expected values of {voxel_type}"),
                    "float64",
                ],
            );
        }
    }
}

#[test]
fn axes_may_be_one_voxel_long() {
    for dims in [[1, 1, 1], [7, 1, 1], [1, 7, 1], [1, 1, 7]] {
        let array = Array::new(dims, VoxelType::U16, Endian::Big);
        let volume = load_bytes("v.nrrd", array.nrrd("gzip", ""));
        assert_eq!((volume.dims, values(&volume)), (dims, array.values));
    }
}

#[test]
fn volumes_are_made_from_values() {
    let voxels = Voxels::F32(vec![1.0, f32::NAN, -3.0]);
    let volume = Volume::from_values([3, 1, 1], [1.0; 3], voxels).unwrap();
    assert_eq!(
        (values(&volume), volume.range),
        (vec![1.0, -3.0, -3.0], [-3.0, 1.0])
    );
    assert!(Volume::from_values([2, 1, 1], [1.0; 3], Voxels::U8(vec![0; 3])).is_err());
    assert!(Volume::from_values([0, 1, 1], [1.0; 3], Voxels::U8(vec![])).is_err());
    assert!(Volume::from_values([1, 1, 1], [1.0, 0.0, 1.0], Voxels::U8(vec![0])).is_err());
}

#[test]
fn offsets_reach_beyond_32_bits() {
    // 8 GiB, nearly all of it a hole in the file.
    let folder = folder();
    let path = folder.path().join("v_2048x2048x1024_uint16.raw");
    let mut file = std::fs::File::create(&path).unwrap();
    file.set_len(8 << 30).unwrap();
    file.seek(SeekFrom::End(-2)).unwrap();
    file.write_all(&[0x34, 0x12]).unwrap();
    let overrides = VolumeOverrides {
        crop: Some([[2046, 2047, 1023], [2048, 2048, 1024]]),
        ..Default::default()
    };
    let volume = Volume::load(&path, &overrides).unwrap();
    assert_eq!(values(&volume), [0.0, 4660.0]);
}
