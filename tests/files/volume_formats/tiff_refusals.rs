//! TIFF that is damaged, promises too much, or is no stack.

use isolume::scene::volume::{Endian, Volume, VolumeOverrides, VoxelType};

use super::tiff::{CODECS, ome, textured};
use crate::tiff_files::{DEFLATE, LZW, Tiff, ZSTD, slice};
use crate::volume_files::{Array, write};
use crate::volume_formats::{folder, load_bytes, plain, refusal, refuses, values};

#[test]
fn what_is_no_stack_is_refused() {
    let array = textured([4, 3, 3], VoxelType::U8, Endian::Little);
    refuses("v.tif", [0; 200], &["TIFF", "`II` or `MM`"]);
    let mut pages: Vec<Array> = (0..3).map(|z| slice(&array, z)).collect();
    pages[1] = textured([3, 3, 1], VoxelType::U8, Endian::Little);
    let odd = Tiff::default().write_pages(&pages);
    refuses("v.tif", odd, &["page 2 of 3", "3×3 pixels, expected 4×3"]);
    pages[1] = textured([4, 3, 1], VoxelType::U16, Endian::Little);
    let odd = Tiff::default().write_pages(&pages);
    refuses(
        "v.tif",
        odd,
        &["page 2 of 3", "uint16", "expected 1 value a pixel, uint8"],
    );
    let jpeg = Tiff {
        compression: 7,
        ..Tiff::default()
    };
    refuses(
        "v.tif",
        jpeg.write(&array),
        &["JPEG (7)", "LZW, deflate, PackBits or zstd"],
    );
    for samples in [1 << 16, u32::MAX] {
        let many = Tiff {
            more: vec![(277, samples)],
            ..Tiff::default()
        };
        let found =
            format!("`SamplesPerPixel` is `{samples}`, expected a whole number from 1 to 65535");
        refuses("v.tif", many.write(&array), &[&found]);
    }
    for compression in CODECS {
        let tiff = Tiff {
            compression,
            ..Tiff::default()
        };
        let mut bytes = tiff.write(&array);
        bytes.truncate(bytes.len() - 7);
        refuses("v.tif", bytes, &["truncated"]);
    }
}

/// As GDAL writes it with SPARSE_OK. The offset 0 is that of the file's own header, which is no pixel.
#[test]
fn a_strip_that_is_left_out_is_no_header() {
    let mut bytes = Tiff::default().write(&textured([4, 3, 1], VoxelType::U8, Endian::Little));
    let offsets = bytes.windows(4).position(|entry| entry == [17, 1, 4, 0]);
    // There are two strips, whose offsets stand elsewhere.
    let list = offsets.unwrap() + 8;
    let at = u32::from_le_bytes(bytes[list..list + 4].try_into().unwrap()) as usize;
    bytes[at..at + 4].fill(0);
    refuses(
        "v.tif",
        bytes,
        &["has no data for a strip or tile", "SPARSE_OK=FALSE"],
    );
}

/// 64 levels are more than any image has. A list that names one directory again and again would be read as often.
#[test]
fn coarser_copies_are_few_and_distinct() {
    let array = textured([4, 3, 1], VoxelType::U8, Endian::Little);
    let tiff = Tiff {
        more: vec![(330, 8)],
        ..Tiff::default()
    };
    let mut bytes = tiff.write(&array);
    let at = bytes.windows(4).position(|entry| entry == [74, 1, 4, 0]);
    let at = at.unwrap();
    // Offsets that are all 0.
    let zeros = (bytes.len() as u32).to_le_bytes();
    bytes[at + 8..at + 12].copy_from_slice(&zeros);
    for count in [2u32, 65, 100_000_000] {
        bytes[at + 4..at + 8].copy_from_slice(&count.to_le_bytes());
        let long = [&bytes[..], &[0; 1024]].concat();
        refuses("v.tif", long, &["more than 64 coarser copies"]);
    }
}

#[test]
fn damaged_strips_are_refused() {
    let array = textured([40, 30, 3], VoxelType::U16, Endian::Little);
    for compression in [LZW, DEFLATE, ZSTD] {
        let tiff = Tiff {
            compression,
            rows_per_strip: 30,
            ..Tiff::default()
        };
        let mut bytes = tiff.write(&array);
        bytes[12..400].fill(0xff);
        refuses(
            "v.tif",
            bytes,
            &["page 1 of 3: a chunk of it, compressed with"],
        );
    }
}

#[test]
fn directories_that_lie_in_one_place_are_refused() {
    // Empty directories of 6 bytes at every fourth byte, each of which leads to the next.
    let words = (3..12).flat_map(|n| [0, 4 * n]).chain([0; 3]);
    let chain: Vec<u8> = words.flat_map(u16::to_le_bytes).collect();
    let header = b"II\x2a\0\x08\0\0\0".as_slice();
    let overlapping = [header, &chain].concat();
    refuses("v.tif", overlapping, &["its directories overlap"]);
    let circle = [header, &[0, 0, 8, 0, 0, 0]].concat();
    refuses("v.tif", circle, &["its directories go round in a circle"]);
}

#[test]
fn coarser_copies_need_not_be_readable() {
    let array = textured([4, 3, 2], VoxelType::U8, Endian::Little);
    let with_copy = |at: usize| {
        let tiff = Tiff {
            more: vec![(330, at as u32)],
            ..Tiff::default()
        };
        tiff.write(&array)
    };
    let at = with_copy(0).len();
    // A directory of 2×1 pixels in JPEG, which lie nowhere.
    let mut copy = vec![4, 0];
    for (tag, value) in [(256_u16, 2), (257, 1), (258, 8), (259, 7)] {
        copy.extend(tag.to_le_bytes());
        copy.extend([3, 0, 1, 0, 0, 0, value, 0, 0, 0]);
    }
    copy.extend([0; 4]);
    let folder = folder();
    let path = write(folder.path(), "v.tif", [with_copy(at), copy].concat());
    let volume = plain(&path);
    assert_eq!(values(&volume), array.values);
    let levels = volume.storage.levels.iter().map(|level| level.dims);
    assert_eq!(levels.collect::<Vec<_>>(), [[4, 3, 2], [2, 1, 2]]);
    let coarser = VolumeOverrides {
        level: Some(1),
        ..Default::default()
    };
    let message = refusal(&path, &coarser);
    assert!(message.contains("JPEG (7)"), "{message}");
}

#[test]
fn numbers_beyond_64_bits_are_refused() {
    // Strips that are said to be as long as can be.
    let array = textured([4, 3, 3], VoxelType::U8, Endian::Little);
    let tiff = Tiff {
        is_big: true,
        compression: ZSTD,
        rows_per_strip: 3,
        ..Tiff::default()
    };
    let mut bytes = tiff.write(&array);
    let counts: Vec<usize> = (0..bytes.len() - 20)
        .filter(|&at| bytes[at..at + 2] == 279_u16.to_le_bytes() && bytes[at + 4] == 1)
        .collect();
    assert_eq!(counts.len(), 3);
    for at in counts {
        bytes[at + 2..at + 4].copy_from_slice(&16_u16.to_le_bytes());
        bytes[at + 12..at + 20].fill(0xff);
    }
    refuses("v.tif", bytes, &["v.tif: "]);
    // Planes that are said to be more than can be counted.
    let tiff = Tiff {
        description: ome("XYZCT", [1 << 31, 1 << 31, 4], ""),
        ..Tiff::default()
    };
    refuses("v.tif", tiff.write(&array), &["3 pages", "OME-XML"]);
}

#[test]
fn channels_are_for_formats_that_have_some() {
    let folder = folder();
    let array = textured([4, 3, 2], VoxelType::U8, Endian::Little);
    let channel = |n| VolumeOverrides {
        channel: Some(n),
        ..Default::default()
    };
    let level = |n| VolumeOverrides {
        level: Some(n),
        ..Default::default()
    };
    let path = write(folder.path(), "v.npy", array.npy(1, false));
    let message = refusal(&path, &channel(1));
    assert!(message.contains("`channel` is only for NRRD"), "{message}");
    // The only one has this number.
    Volume::load(&path, &channel(0)).expect("a volume");
    let path = write(folder.path(), "v.nrrd", array.nrrd("raw", ""));
    let message = refusal(&path, &level(1));
    assert!(message.contains("`level` is only for TIFF"), "{message}");
    Volume::load(&path, &level(0)).expect("a volume");
}

/// `FillOrder` and `Orientation`.
#[test]
fn bits_and_pictures_in_another_order_are_not_taken_for_the_usual() {
    let array = textured([4, 3, 2], VoxelType::U16, Endian::Little);
    let with = |tag, value| {
        let tiff = Tiff {
            more: vec![(tag, value)],
            ..Tiff::default()
        };
        tiff.write(&array)
    };
    refuses(
        "v.tif",
        with(266, 2),
        &["`FillOrder` is `2`", "tiffcp -f msb2lsb"],
    );
    assert!(load_bytes("v.tif", with(266, 1)).notes.is_empty());
    assert!(load_bytes("v.tif", with(274, 1)).notes.is_empty());
    let volume = load_bytes("v.tif", with(274, 4));
    assert_eq!(values(&volume), array.values);
    assert!(
        volume.notes[0].contains("turned or mirrored"),
        "{:?}",
        volume.notes
    );
}
