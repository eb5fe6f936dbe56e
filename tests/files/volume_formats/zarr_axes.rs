//! OME-Zarr: axes in any order, with channels, times and levels, and those of an array alone.

use std::fs;

use isolume::scene::volume::{Endian, Volume, VolumeOverrides, VoxelType};
use serde_json::json;

use super::zarr::textured;
use crate::volume_files::Array;
use crate::volume_formats::{folder, plain, refusal, values};
use crate::zarr_files::{Codec, Zarr};

/// The voxel whose values are written for each place: channel, time, and its place in the volume.
fn tagged(axes: &str, sizes: &[(char, usize)]) -> (Vec<usize>, Array) {
    let size = |axis| {
        sizes
            .iter()
            .find(|(name, _)| *name == axis)
            .map_or(1, |found| found.1)
    };
    let shape: Vec<usize> = axes.chars().map(size).collect();
    let count = shape.iter().product::<usize>();
    let mut array = Array::new([1, 1, count as u32], VoxelType::U16, Endian::Little);
    for (n, value) in array.values.iter_mut().enumerate() {
        let (mut rest, mut tag) = (n, 0);
        for (axis, side) in axes.chars().rev().zip(shape.iter().rev()) {
            let weight = match axis {
                'x' => 1,
                'y' => 8,
                'z' => 64,
                'c' => 512,
                _ => 2048,
            };
            tag += rest % side * weight;
            rest /= side;
        }
        *value = tag as f64;
    }
    (shape, array)
}

#[test]
fn axes_come_in_any_subset() {
    let sizes = [('t', 2), ('c', 3), ('z', 4), ('y', 5), ('x', 6)];
    for axes in [
        "tczyx", "czyx", "tzyx", "zyx", "yx", "cyx", "tcyx", "xyz", "zyxc", "yzxt",
    ] {
        let (shape, array) = tagged(axes, &sizes);
        for side in [1, 2, 7] {
            let folder = folder();
            let zarr = Zarr::new(side == 2, &vec![side; shape.len()], Codec::Zstd);
            let path = zarr.write(&folder.path().join("v"), axes, &shape, &array);
            let has = |axis: char| axes.contains(axis);
            let (channel, time) = (if has('c') { 2 } else { 0 }, u32::from(has('t')));
            let overrides = VolumeOverrides {
                channel: Some(channel),
                time: Some(time),
                ..Default::default()
            };
            let volume = Volume::load(&path, &overrides).unwrap();
            let depth = if has('z') { 4 } else { 1 };
            assert_eq!(volume.dims, [6, 5, depth], "{axes}");
            let mut expected = Vec::new();
            for z in 0..depth {
                for y in 0..5 {
                    let tag = |x| z * 64 + y * 8 + x + channel * 512 + time * 2048;
                    expected.extend((0..6).map(|x| f64::from(tag(x))));
                }
            }
            assert_eq!(values(&volume), expected, "{axes} {side}");
        }
    }
}

/// Zarr 3 names the axes of an array, and only names that are known are taken.
#[test]
fn an_array_alone_has_the_axes_that_it_names() {
    let folder = folder();
    let array = textured([5, 4, 3], VoxelType::U8);
    let zarr = Zarr::new(true, &[2, 2, 2], Codec::Gzip);
    let path = zarr.write_array(&folder.path().join("v"), &[3, 4, 5], &array);
    let metadata = path.join("zarr.json");
    let text = fs::read_to_string(&metadata).unwrap();
    let transposed = [5, 4, 3].map(|size| size as usize);
    let turned: Vec<f64> = (0..60)
        .map(|n| {
            let [x, y, z] = [n % 3, n / 3 % 4, n / 12];
            array.values[(x * transposed[1] + y) * transposed[0] + z]
        })
        .collect();
    for (names, dims, expected) in [
        (json!(["x", "y", "z"]), [3, 4, 5], &turned[..]),
        (json!(["z", "y", "x"]), [5, 4, 3], &array.values[..]),
        (json!(["C", "Y", "X"]), [5, 4, 1], &array.values[..20]),
        (json!(["x", null, "z"]), [5, 4, 3], &array.values[..]),
        (json!(["x", "x", "y"]), [5, 4, 3], &array.values[..]),
        (json!(["z", "c", "t"]), [5, 4, 3], &array.values[..]),
        (json!(["x", "y"]), [5, 4, 3], &array.values[..]),
        (json!(null), [5, 4, 3], &array.values[..]),
    ] {
        let named = format!("{{\"dimension_names\":{names},");
        fs::write(&metadata, text.replacen('{', &named, 1)).unwrap();
        let volume = plain(&path);
        assert_eq!(volume.dims, dims, "{names}");
        assert_eq!(values(&volume), expected, "{names}");
    }
}

/// xarray names the axes of an array of Zarr 2 among its attributes.
#[test]
fn an_array_of_zarr_2_has_the_axes_that_its_attributes_name() {
    let folder = folder();
    let array = textured([5, 4, 3], VoxelType::U8);
    let zarr = Zarr::new(false, &[2, 2, 2], Codec::Gzip);
    let path = zarr.write_array(&folder.path().join("v"), &[3, 4, 5], &array);
    for (attributes, dims) in [
        (r#"{"_ARRAY_DIMENSIONS": ["x", "y", "z"]}"#, [3, 4, 5]),
        (
            r#"{"offset": NaN, "_ARRAY_DIMENSIONS": ["c", "y", "x"]}"#,
            [5, 4, 1],
        ),
        (r#"{"_ARRAY_DIMENSIONS": ["x", "y"]}"#, [5, 4, 3]),
        (r#"{"_ARRAY_DIMENSIONS": ["x", null, "z"]}"#, [5, 4, 3]),
        (r#"{"_ARRAY_DIMENSIONS": "xyz"}"#, [5, 4, 3]),
        (r#"{"_ARRAY_DIMENSIONS": ["x", "#, [5, 4, 3]),
        ("{}", [5, 4, 3]),
    ] {
        fs::write(path.join(".zattrs"), attributes).unwrap();
        let volume = plain(&path);
        assert_eq!(volume.dims, dims, "{attributes}");
        let second_along_x = match dims[0] {
            3 => 20,
            _ => 1,
        };
        let expected = array.values[second_along_x];
        assert_eq!(values(&volume)[1], expected, "{attributes}");
    }
}

/// An axis is what its type says; keys without a value may be there as `null`.
#[test]
fn axes_are_known_by_their_type() {
    let folder = folder();
    let array = textured([5, 4, 3], VoxelType::U8);
    let zarr = Zarr::new(false, &[2, 2, 2], Codec::Gzip);
    let path = zarr.write(&folder.path().join("v"), "cyx", &[3, 4, 5], &array);
    let image = json!({"multiscales": [{
        "axes": [
            {"name": "channel", "type": "channel", "unit": null},
            {"name": "Y", "type": null},
            {"name": "x", "type": "space", "unit": "micrometer"},
        ],
        "datasets": [{"path": "s0", "coordinateTransformations": null}],
        "coordinateTransformations": null,
        "name": null,
    }], "omero": null});
    fs::write(path.join(".zattrs"), image.to_string()).unwrap();
    let second = VolumeOverrides {
        channel: Some(1),
        ..Default::default()
    };
    let volume = Volume::load(&path, &second).unwrap();
    assert_eq!(values(&volume), array.values[20..40]);
    assert_eq!(volume.spacing, [1.0; 3]);
}

#[test]
fn a_transposition_may_have_a_name() {
    let folder = folder();
    let array = textured([5, 4, 3], VoxelType::U8);
    let zarr = Zarr {
        order: vec![2, 1, 0],
        ..Zarr::new(true, &[2, 2, 2], Codec::Gzip)
    };
    let path = zarr.write_array(&folder.path().join("v"), &[3, 4, 5], &array);
    let metadata = path.join("zarr.json");
    let text = fs::read_to_string(&metadata).unwrap();
    let named = |name: &str| text.replace("\"order\":[2,1,0]", &format!("\"order\":{name}"));
    fs::write(&metadata, named("\"F\"")).unwrap();
    assert_eq!(values(&plain(&path)), array.values);
    fs::write(&metadata, named("\"K\"")).unwrap();
    let message = refusal(&path, &VolumeOverrides::default());
    assert!(
        message.contains("`order` is `K`, expected a list of axes"),
        "{message}"
    );
    fs::write(&metadata, named("{}")).unwrap();
    let message = refusal(&path, &VolumeOverrides::default());
    assert!(message.contains("zarr.json: a codec, a grid"), "{message}");
}

#[test]
fn levels_have_their_own_size() {
    let folder = folder();
    let path = folder.path().join("v.zarr");
    let zarr = Zarr::new(true, &[4, 4, 4], Codec::Gzip);
    let fine = textured([8, 6, 4], VoxelType::U8);
    let coarse = textured([4, 3, 4], VoxelType::U8);
    zarr.write_array(&path.join("0"), &[4, 6, 8], &fine);
    zarr.write_array(&path.join("1"), &[4, 3, 4], &coarse);
    let arrays = [("0", vec![2.0, 0.5, 0.5]), ("1", vec![2.0, 1.0, 1.0])];
    zarr.write_group(&path, "zyx", &arrays);
    let at = |level| VolumeOverrides {
        level: Some(level),
        ..Default::default()
    };
    let volume = Volume::load(&path, &at(1)).unwrap();
    assert_eq!((volume.dims, volume.spacing), ([4, 3, 4], [1.0, 1.0, 2.0]));
    assert_eq!(values(&volume), coarse.values);
    let dims: Vec<_> = volume
        .storage
        .levels
        .iter()
        .map(|level| level.dims)
        .collect();
    assert_eq!(dims, [[8, 6, 4], [4, 3, 4]]);
    assert_eq!(values(&plain(&path)), fine.values);
    assert!(refusal(&path, &at(2)).contains("volume.level: found 2, expected 0 to 1"));
    // An array alone is a volume as well.
    assert_eq!(values(&plain(&path.join("1"))), coarse.values);
}
