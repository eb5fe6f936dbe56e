//! TIFF whose pixels have several values each.

use isolume::scene::volume::{Endian, Volume, VolumeOverrides, VoxelType};

use super::tiff::{ome, textured};
use crate::tiff_files::Tiff;
use crate::volume_files::{Array, write};
use crate::volume_formats::{folder, load_bytes, refusal, refuses, values};

/// Pages with so many values for each pixel, which `wide` has side by side.
fn side_by_side(tiff: &Tiff, wide: &Array, samples: u32) -> Vec<u8> {
    let tiff = Tiff {
        more: vec![(277, samples)],
        rows_per_strip: 1,
        ..tiff.clone()
    };
    let mut bytes = tiff.write(wide);
    let entry = |width: u32| [&[0, 1, 4, 0, 1, 0, 0, 0], &width.to_le_bytes()[..]].concat();
    let [wide, narrow] = [wide.dims[0], wide.dims[0] / samples].map(entry);
    for at in 0..bytes.len() - wide.len() {
        if bytes[at..].starts_with(&wide) {
            bytes[at..at + narrow.len()].copy_from_slice(&narrow);
        }
    }
    bytes
}

/// As tifffile writes an array whose last axis is no colour.
#[test]
fn values_that_are_no_colour_are_channels() {
    let wide = textured([12, 3, 1], VoxelType::U8, Endian::Little);
    let volume = load_bytes("v.tif", side_by_side(&Tiff::default(), &wide, 3));
    let first: Vec<f64> = wide.values.iter().step_by(3).copied().collect();
    assert_eq!(values(&volume), first);
    assert!(volume.notes[0].contains("channel 0 of 3 is shown"));
}

#[test]
fn channels_beyond_all_names_are_counted() {
    let wide = textured([65535, 1, 2], VoxelType::U8, Endian::Little);
    let tiff = Tiff {
        description: ome("XYZCT", [1, 2 * 65535, 1], "<TiffData/>"),
        ..Tiff::default()
    };
    let folder = folder();
    let bytes = side_by_side(&tiff, &wide, 65535);
    let path = write(folder.path(), "v.tif", bytes);
    let of = |channel| VolumeOverrides {
        channel: Some(channel),
        ..Default::default()
    };
    let last = 2 * 65535 - 1;
    let volume = Volume::load(&path, &of(last)).unwrap();
    assert_eq!(values(&volume), [wide.values[last as usize]]);
    assert_eq!(volume.storage.channels, last + 1);
    assert_eq!(volume.storage.channel_names, ["DAPI", "GFP"]);
    let message = refusal(&path, &of(last + 1));
    assert!(message.contains("expected 0 to 131069"), "{message}");
}

#[test]
fn pages_with_other_numbers_of_values_are_refused() {
    let wide = textured([12, 3, 2], VoxelType::U8, Endian::Little);
    let tiff = Tiff {
        description: ome("XYZCT", [1, 6, 1], "<TiffData/>"),
        ..Tiff::default()
    };
    let mut bytes = side_by_side(&tiff, &wide, 3);
    let three = [0x15, 1, 4, 0, 1, 0, 0, 0, 3];
    let last = bytes.windows(three.len()).rposition(|bytes| bytes == three);
    bytes[last.expect("a second page") + 8] = 1;
    let folder = folder();
    let path = write(folder.path(), "v.tif", bytes);
    let overrides = VolumeOverrides {
        channel: Some(5),
        ..Default::default()
    };
    let message = refusal(&path, &overrides);
    assert!(
        message.contains("has 1 values in each pixel, expected 3 like the file's first page"),
        "{message}"
    );
}

#[test]
fn a_channel_of_a_picture_in_colour_is_asked_for() {
    let wide = textured([12, 3, 1], VoxelType::U8, Endian::Little);
    let colour = Tiff {
        photometric: 2,
        ..Tiff::default()
    };
    refuses(
        "v.tif",
        side_by_side(&colour, &wide, 3),
        &["in colour", "3 values", "volume.channel=0"],
    );
}
