//! TIFF as ImageJ writes it: its description, and stacks with a single directory, which tifffile writes as well.

use std::path::Path;

use isolume::scene::volume::{Endian, Volume, VolumeOverrides, VoxelType};

use super::tiff::textured;
use crate::tiff_files::{Tiff, slice};
use crate::volume_files::{Array, write};
use crate::volume_formats::{folder, load_bytes, refusal, refuses, values};

#[test]
fn imagej_says_how_large_voxels_are() {
    let array = textured([4, 3, 6], VoxelType::U8, Endian::Big);
    let mut tiff = Tiff {
        description: "ImageJ=1.53t\nimages=6\nslices=6\nunit=\\u00B5m\nspacing=2.5\nloop=false\n"
            .into(),
        resolution: Some([4, 2]),
        ..Tiff::default()
    };
    let volume = load_bytes("v.tif", tiff.write(&array));
    assert_eq!(volume.spacing, [0.25, 0.5, 2.5]);
    assert_eq!(volume.storage.unit.as_deref(), Some("µm"));
    assert_eq!(values(&volume), array.values);

    tiff.description = "ImageJ=1.53t\nimages=6\nchannels=3\nslices=2\nhyperstack=true\n".into();
    let folder = folder();
    let path = write(folder.path(), "v.tif", tiff.write(&array));
    for channel in 0..3 {
        let overrides = VolumeOverrides {
            channel: Some(channel),
            ..Default::default()
        };
        let volume = Volume::load(&path, &overrides).unwrap();
        let pages = [channel, channel + 3].map(|n| slice(&array, n).values);
        assert_eq!(values(&volume), pages.concat());
        assert!(
            volume.notes[0].contains(" of 3 is shown"),
            "{:?}",
            volume.notes
        );
    }
    let overrides = VolumeOverrides {
        channel: Some(3),
        ..Default::default()
    };
    let message = refusal(&path, &overrides);
    assert!(
        message.contains("volume.channel: found 3, expected 0 to 2"),
        "{message}"
    );
}

#[test]
fn imagej_may_measure_depth_in_another_unit() {
    let array = textured([4, 3, 2], VoxelType::U8, Endian::Big);
    let tiff = Tiff {
        description: "ImageJ=1.53t\nimages=2\nslices=2\nunit=\\u00B5m\nzunit=nm\nspacing=50\n"
            .into(),
        resolution: Some([4, 2]),
        ..Tiff::default()
    };
    let volume = load_bytes("v.tif", tiff.write(&array));
    assert_eq!(volume.spacing, [0.25, 0.5, 0.05]);
}

/// Without a unit in the description, as tifffile writes it, TIFF's own tag says what pixels are counted in.
#[test]
fn imagej_takes_the_unit_of_tiff() {
    let array = textured([4, 3, 2], VoxelType::U8, Endian::Big);
    for (unit, pixels, described, spacing, named) in [
        (Some(1), 2, "", [0.5, 0.5, 2.0], None),
        (Some(2), 4, "", [0.25, 0.25, 2.0], Some("inch")),
        (Some(2), 72, "", [1.0, 1.0, 2.0], None),
        (Some(2), 300, "unit=pixel\n", [1.0, 1.0, 2.0], None),
        (Some(3), 4, "", [0.25, 0.25, 2.0], Some("cm")),
        (Some(3), 100_000, "unit=um\n", [0.1, 0.1, 2.0], Some("µm")),
        (None, 4, "", [1.0, 1.0, 2.0], None),
    ] {
        let tiff = Tiff {
            description: format!("ImageJ=1.11a\nimages=2\nslices=2\nspacing=2.0\n{described}"),
            resolution: Some([pixels; 2]),
            more: unit.map(|unit| (296, unit)).into_iter().collect(),
            ..Tiff::default()
        };
        let volume = load_bytes("v.tif", tiff.write(&array));
        assert_eq!(volume.spacing, spacing, "{unit:?}");
        assert_eq!(volume.storage.unit.as_deref(), named, "{unit:?}");
    }
}

/// As it saves a stack as a sequence of images: each has the calibration, and none the distance to the next.
#[test]
fn a_folder_of_imagej_pages_is_calibrated() {
    let folder = folder();
    let array = textured([4, 3, 3], VoxelType::U16, Endian::Big);
    let tiff = Tiff {
        description: "ImageJ=1.53t\nunit=mm\ncf=0\nc0=-32768.0\nc1=1.0\n".into(),
        resolution: Some([4, 2]),
        ..Tiff::default()
    };
    tiff.write_files(folder.path(), &array, |z| format!("{z}.tif"));
    let volume = Volume::load(folder.path(), &VolumeOverrides::default()).unwrap();
    let expected: Vec<f64> = array.values.iter().map(|value| value - 32768.0).collect();
    assert_eq!(values(&volume), expected);
    assert_eq!(volume.spacing, [0.25, 0.5, 1.0]);
    let note = "ImageJ does not state the whole voxel size: it is taken as 1 mm along z; set volume.spacing";
    assert!(
        volume.notes.iter().any(|n| n.contains(note)),
        "{:?}",
        volume.notes
    );
}

/// Signed numbers are stored as unsigned ones, with a calibration.
#[test]
fn imagej_calibrates_values() {
    let array = textured([4, 3, 2], VoxelType::U16, Endian::Big);
    let opened = |array: &Array, more: &str| {
        let tiff = Tiff {
            description: format!("ImageJ=1.53t\nimages=2\nslices=2\n{more}"),
            ..Tiff::default()
        };
        load_bytes("v.tif", tiff.write(array))
    };
    let signed = opened(&array, "cf=0\nc0=-32768.0\nc1=1.0\nvunit=Gray Value\n");
    let expected: Vec<f64> = array.values.iter().map(|value| value - 32768.0).collect();
    assert_eq!(values(&signed), expected);
    assert!(signed.notes.is_empty(), "{:?}", signed.notes);
    for (more, notes) in [
        ("cf=20\n", 0),
        ("cf=8\nc0=1\n", 1),
        ("cf=0\nc0=1\nc1=0\n", 1),
    ] {
        let volume = opened(&array, more);
        assert_eq!(values(&volume), array.values);
        assert_eq!(volume.notes.len(), notes, "{:?}", volume.notes);
    }
    for voxel_type in [VoxelType::F16, VoxelType::F32] {
        let floats = textured([4, 3, 2], voxel_type, Endian::Big);
        let volume = opened(&floats, "cf=0\nc0=-32768.0\nc1=1.0\n");
        assert_eq!(values(&volume), floats.values);
    }
}

/// The file, with its pixels in place of those of a first page that are the only ones it had, in strips of 3 rows.
fn of_one_directory(tiff: &Tiff, first: &Array, pixels: &[u8]) -> Vec<u8> {
    // Pixels come first in what is written here, so they are moved behind the directory.
    let mut page = tiff.write(first);
    let begin = page.len() as u32;
    let place = page.windows(4).position(|entry| entry == [1, 17, 0, 4]);
    let entry = place.unwrap();
    page[entry + 8..entry + 12].copy_from_slice(&begin.to_be_bytes());
    [&page, pixels].concat()
}

/// Only the first page has a directory; the pixels of all lie one after another.
#[test]
fn imagej_may_write_one_directory_for_all_pages() {
    let array = textured([4, 3, 6], VoxelType::U16, Endian::Big);
    let tiff = Tiff {
        description: "ImageJ=1.53t\nimages=6\nslices=6\n".into(),
        rows_per_strip: 3,
        ..Tiff::default()
    };
    let whole = of_one_directory(&tiff, &slice(&array, 0), &array.bytes());
    assert_eq!(values(&load_bytes("v.tif", &whole)), array.values);
    refuses("v.tif", &whole[..whole.len() - 50], &["truncated"]);

    // In colour: the three values of a pixel lie side by side.
    let colour = Tiff {
        more: vec![(277, 3)],
        ..tiff
    };
    let pixels = Array {
        dims: [12, 3, 6],
        ..textured([12, 3, 6], VoxelType::U16, Endian::Big)
    };
    let whole = of_one_directory(&colour, &slice(&array, 0), &pixels.bytes());
    let folder = folder();
    let path = write(folder.path(), "v.tif", &whole);
    for channel in 0..3 {
        let overrides = VolumeOverrides {
            channel: Some(channel),
            ..Default::default()
        };
        let volume = Volume::load(&path, &overrides).unwrap();
        let samples = pixels.values.iter().skip(channel as usize).step_by(3);
        assert_eq!(values(&volume), samples.copied().collect::<Vec<_>>());
    }
    let half = write(folder.path(), "half.tif", &whole[..whole.len() / 2]);
    let message = refusal(&half, &VolumeOverrides::default());
    assert!(message.contains("truncated"), "{message}");
}

/// As `tifffile.imwrite` writes an array with `truncate=True`.
#[test]
fn tifffile_may_write_one_directory_for_all_pages() {
    let array = textured([4, 3, 6], VoxelType::U16, Endian::Big);
    let first = slice(&array, 0);
    let described = |description: &str| {
        let tiff = Tiff {
            description: description.into(),
            rows_per_strip: 3,
            ..Tiff::default()
        };
        of_one_directory(&tiff, &first, &array.bytes())
    };
    let whole = described("{\"shape\": [6, 3, 4], \"truncated\": true}");
    assert_eq!(values(&load_bytes("v.tif", &whole)), array.values);
    refuses("v.tif", &whole[..whole.len() - 50], &["truncated"]);
    for alone in [
        "{\"shape\": [6, 3, 4]}",
        "{\"shape\": [3, 4], \"truncated\": true}",
    ] {
        let page = load_bytes("v.tif", described(alone));
        assert_eq!(values(&page), first.values, "{alone}");
    }
}

/// The volume of a channel and a time.
fn chosen(path: &Path, channel: u32, time: u32) -> Volume {
    let overrides = VolumeOverrides {
        channel: Some(channel),
        time: Some(time),
        ..Default::default()
    };
    Volume::load(path, &overrides).unwrap()
}

#[test]
fn tifffile_names_the_axes_of_pages() {
    let array = textured([4, 3, 12], VoxelType::U8, Endian::Little);
    let folder = folder();
    let described = |description: &str| {
        let tiff = Tiff {
            description: description.into(),
            ..Tiff::default()
        };
        write(folder.path(), "v.tif", tiff.write(&array))
    };
    let pages = |pages: &[u32]| -> Vec<f64> {
        let values = pages.iter().flat_map(|n| slice(&array, *n).values);
        values.collect()
    };
    let path = described("{\"shape\": [2, 3, 1, 2, 3, 4], \"axes\": \"TZICYX\"}");
    assert_eq!(values(&chosen(&path, 1, 1)), pages(&[7, 9, 11]));
    let path = described("{\"shape\": [3, 4, 3, 4], \"axes\": \"CZYX\"}");
    assert_eq!(values(&chosen(&path, 2, 0)), pages(&[8, 9, 10, 11]));
    let path = described("{\"shape\": [12, 3, 4]}");
    assert_eq!(chosen(&path, 0, 0).notes, [""; 0]);
    // Not all names are stated.
    let told = |volume: &Volume, expected: &[&str]| {
        let said = |part: &&str| volume.notes.iter().any(|note| note.contains(*part));
        assert!(expected.iter().all(said), "{:?}", volume.notes);
    };
    let path = described("{\"shape\": [3, 4, 3, 4]}");
    let volume = chosen(&path, 0, 1);
    assert_eq!(values(&volume), pages(&[4, 5, 6, 7]));
    let axes = [
        "its axis of 3 pages is: it is taken as time",
        "its axis of 4 pages is: it is taken as z",
    ];
    told(&volume, &axes);
    let path = described("{\"shape\": [2, 3, 2, 3, 4], \"axes\": \"QZCYX\"}");
    let volume = chosen(&path, 1, 1);
    assert_eq!(values(&volume), pages(&[7, 9, 11]));
    told(&volume, &["its axis of 2 pages is: it is taken as time"]);
    let path = described("{\"shape\": [2, 3, 2, 3, 4], \"axes\": \"QQQYX\"}");
    let volume = chosen(&path, 0, 0);
    assert_eq!(values(&volume), array.values);
    told(
        &volume,
        &["the axes of its 2 × 3 × 2 pages are: all are taken as slices"],
    );
}

#[test]
fn hyperstacks_may_be_in_colour() {
    let pages = textured([4, 3, 6], VoxelType::U16, Endian::Big);
    let pixels = textured([12, 3, 6], VoxelType::U16, Endian::Big);
    let tiff = Tiff {
        description: "ImageJ=1.53t\nimages=6\nslices=3\nframes=2\nhyperstack=true\n".into(),
        rows_per_strip: 3,
        more: vec![(277, 3)],
        ..Tiff::default()
    };
    let folder = folder();
    let whole = of_one_directory(&tiff, &slice(&pages, 0), &pixels.bytes());
    let path = write(folder.path(), "v.tif", whole);
    let volume = chosen(&path, 1, 1);
    assert_eq!(volume.dims, [4, 3, 3]);
    let later = pixels.values[12 * 3 * 3..].iter();
    let expected: Vec<f64> = later.skip(1).step_by(3).copied().collect();
    assert_eq!(values(&volume), expected);
}
