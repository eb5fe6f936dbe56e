//! OME-Zarr: each version and codec gives the same volume; what is damaged or no image is refused.

use std::fs;
use std::path::{Path, PathBuf};

use isolume::scene::volume::{Endian, VolumeOverrides, VoxelType, Voxels};
use serde_json::json;

use crate::volume_files::Array;
use crate::volume_formats::{DIMS, folder, plain, refusal, round_trip_with_halves, values};
use crate::zarr_files::blosc::{Blosc, Inner};
use crate::zarr_files::{Codec, Zarr};

const SHAPE: [usize; 3] = [DIMS[2] as usize, DIMS[1] as usize, DIMS[0] as usize];

fn codecs() -> Vec<Codec> {
    let mut codecs = vec![
        Codec::Plain,
        Codec::Gzip,
        Codec::Zlib,
        Codec::Zstd,
        Codec::Bzip2,
        Codec::Lz4,
    ];
    for inner in [Inner::BloscLz, Inner::Lz4, Inner::Zlib, Inner::Zstd] {
        for (shuffle, is_split, block) in [(0, false, 999), (1, true, 2048), (4, false, 1024)] {
            codecs.push(Codec::Blosc(Blosc {
                inner,
                shuffle,
                is_split,
                block,
            }));
        }
    }
    codecs
}

pub fn message_of(path: &Path, parts: &[&str]) {
    let message = refusal(path, &VolumeOverrides::default());
    for part in parts {
        assert!(message.contains(part), "`{part}` is not in: {message}");
    }
}

#[test]
fn each_type_byte_order_and_version_round_trips() {
    for is_version_3 in [false, true] {
        round_trip_with_halves(|folder, array| {
            let zarr = Zarr::new(is_version_3, &[1, 2, 3], Codec::Gzip);
            zarr.write(&folder.join("v.zarr"), "zyx", &SHAPE, array)
        });
    }
}

/// As n5-zarr once wrote them: chunks in folders, without a word about it, and a number as text.
#[test]
fn chunks_in_folders_are_found() {
    let array = textured(DIMS, VoxelType::U16);
    let folder = folder();
    let mut zarr = Zarr::new(false, &[1, 2, 3], Codec::Plain);
    zarr.fill = json!("0");
    let path = zarr.write(&folder.path().join("v.zarr"), "zyx", &SHAPE, &array);
    let metadata = path.join("s0/.zarray");
    let text = fs::read_to_string(&metadata).unwrap();
    let mut told: serde_json::Value = serde_json::from_str(&text).unwrap();
    assert!(
        told.as_object_mut()
            .unwrap()
            .remove("dimension_separator")
            .is_some()
    );
    fs::write(metadata, told.to_string()).unwrap();
    assert_eq!(values(&plain(&path)), array.values);
}

/// Values with runs, repetitions and noise.
pub fn textured(dims: [u32; 3], voxel_type: VoxelType) -> Array {
    let mut array = Array::new(dims, voxel_type, Endian::Little);
    let mut rng = fastrand::Rng::with_seed(11);
    let mut line: Vec<f64> = (0..90).map(|_| f64::from(rng.u8(..))).collect();
    for (n, value) in array.values.iter_mut().enumerate() {
        if n % 3000 == 0 {
            line[rng.usize(..90)] = f64::from(rng.u8(..));
        }
        *value = if n / 200 % 3 == 0 { 7.0 } else { line[n % 90] };
    }
    array
}

#[test]
fn each_codec_is_the_same_volume() {
    for voxel_type in [VoxelType::U8, VoxelType::U16, VoxelType::F32] {
        let array = textured([45, 37, 29], voxel_type);
        for is_version_3 in [false, true] {
            for codec in codecs() {
                let folder = folder();
                let zarr = Zarr::new(is_version_3, &[16, 20, 45], codec);
                let path = zarr.write(&folder.path().join("v"), "zyx", &[29, 37, 45], &array);
                let volume = plain(&path);
                assert_eq!(values(&volume), array.values, "{voxel_type} {zarr:?}");
                assert_eq!(volume.spacing, [0.5, 0.5, 2.0]);
                assert_eq!(volume.storage.unit.as_deref(), Some("µm"));
                assert_eq!(volume.storage.format, "OME-Zarr");
            }
        }
    }
}

#[test]
fn shards_checksums_keys_and_orders_are_the_same_volume() {
    let array = textured([25, 17, 19], VoxelType::U16);
    let base = Zarr::new(true, &[4, 5, 8], Codec::Zstd);
    let cases = [
        Zarr {
            shard: Some(vec![8, 20, 16]),
            ..base.clone()
        },
        Zarr {
            shard: Some(vec![8, 20, 16]),
            is_index_at_end: false,
            ..base.clone()
        },
        Zarr {
            shard: Some(vec![4, 5, 8]),
            has_checksum: true,
            codec: Codec::Plain,
            ..base.clone()
        },
        Zarr {
            separator: '.',
            has_checksum: true,
            ..base.clone()
        },
        Zarr {
            order: vec![2, 0, 1],
            ..base.clone()
        },
        Zarr {
            order: vec![2, 1, 0],
            shard: Some(vec![8, 10, 16]),
            ..base.clone()
        },
        Zarr {
            is_version_3: false,
            order: vec![2, 1, 0],
            ..base.clone()
        },
        Zarr {
            is_version_3: false,
            separator: '.',
            ..base.clone()
        },
        Zarr {
            chunk: vec![64, 64, 64],
            ..base.clone()
        },
    ];
    for zarr in cases {
        let folder = folder();
        let path = zarr.write(&folder.path().join("v"), "zyx", &[19, 17, 25], &array);
        assert_eq!(values(&plain(&path)), array.values, "{zarr:?}");
    }
}

#[test]
fn chunks_that_were_never_written_have_the_fill_value() {
    let mut array = textured([20, 18, 16], VoxelType::F32);
    for (n, value) in array.values.iter_mut().enumerate() {
        if n % 20 >= 8 {
            *value = -3.5;
        }
    }
    for shard in [None, Some(vec![8, 8, 16])] {
        let folder = folder();
        let zarr = Zarr {
            unwritten: Some(-3.5),
            fill: json!(-3.5),
            shard,
            ..Zarr::new(true, &[4, 4, 4], Codec::Zstd)
        };
        let path = zarr.write(&folder.path().join("v"), "zyx", &[16, 18, 20], &array);
        assert_eq!(values(&plain(&path)), array.values);
    }
}

/// As a number, as text, or as the bits of one. What is not finite becomes the smallest value.
#[test]
fn a_fill_value_is_any_number_of_16_bits() {
    for (fill, expected) in [
        (json!(-3.5), -3.5),
        (json!("0xc300"), -3.5),
        (json!("0x0001"), f64::powi(2.0, -24)),
        (json!("0x7e00"), 1.0),
        (json!("NaN"), 1.0),
        (json!("-Infinity"), 1.0),
    ] {
        for (is_version_3, endian) in [
            (false, Endian::Big),
            (true, Endian::Big),
            (true, Endian::Little),
        ] {
            let mut array = Array::new([2, 1, 2], VoxelType::F16, endian);
            array.values = vec![1.0, 2.0, 0.0, 0.0];
            let folder = folder();
            let zarr = Zarr {
                unwritten: Some(0.0),
                fill: fill.clone(),
                ..Zarr::new(is_version_3, &[1, 1, 2], Codec::Plain)
            };
            let path = zarr.write(&folder.path().join("v"), "zyx", &[2, 1, 2], &array);
            let expected = [1.0, 2.0, expected, expected];
            let case = format!("{fill} {is_version_3} {endian:?}");
            assert_eq!(values(&plain(&path)), expected, "{case}");
            // As Python writes NaN and infinities.
            let name = if is_version_3 { "zarr.json" } else { ".zarray" };
            let metadata = path.join("s0").join(name);
            let text = fs::read_to_string(&metadata).unwrap();
            for word in ["NaN", "-Infinity"] {
                fs::write(&metadata, text.replace(&format!("\"{word}\""), word)).unwrap();
                assert_eq!(values(&plain(&path)), expected, "bare {case}");
            }
        }
    }
}

/// One chunk of 4096.
#[test]
fn a_few_chunks_may_stand_for_a_large_volume() {
    let folder = folder();
    let mut array = Array::new([16; 3], VoxelType::U8, Endian::Little);
    array.values.fill(7.0);
    let zarr = Zarr::new(true, &[16; 3], Codec::Zstd);
    let path = zarr.write(&folder.path().join("v"), "zyx", &[16; 3], &array);
    let metadata = path.join("s0/zarr.json");
    let text = fs::read_to_string(&metadata).unwrap();
    let whole = text.replace("\"shape\":[16,16,16]", "\"shape\":[256,256,256]");
    assert_ne!(whole, text);
    fs::write(&metadata, whole).unwrap();
    let volume = plain(&path);
    assert_eq!(volume.dims, [256; 3]);
    assert_eq!(volume.range, [0.0, 7.0]);
    let Voxels::U8(voxels) = &*volume.voxels().unwrap() else {
        panic!("{:?}", volume.stored);
    };
    assert_eq!(
        voxels.iter().filter(|value| **value == 7).count(),
        16 * 16 * 16
    );
}

/// Programs that store what does not change only once put links in its places.
#[cfg(unix)]
#[test]
fn files_may_be_links() {
    let folder = folder();
    let array = textured(DIMS, VoxelType::U16);
    let zarr = Zarr::new(true, &[1, 2, 3], Codec::Gzip);
    let real = zarr.write_array(&folder.path().join("real"), &SHAPE, &array);
    let links = folder.path().join("links");
    fs::create_dir_all(links.join("c/0/0")).unwrap();
    for name in ["zarr.json", "c/1", "c/0/1", "c/0/0/0", "c/0/0/1"] {
        std::os::unix::fs::symlink(real.join(name), links.join(name)).unwrap();
    }
    let volume = plain(&links);
    assert_eq!(values(&volume), array.values);
    let count = |path: &Path| plain(path).files.len();
    assert_eq!(count(&links), count(&real));
    // In circles.
    for name in ["c/0/0/round", "c/0/0/9"] {
        std::os::unix::fs::symlink(&links, links.join(name)).unwrap();
    }
    assert_eq!(values(&plain(&links)), array.values);
    // What a link leads to may not be there.
    fs::rename(real.join("c/0/0/1"), real.join("away")).unwrap();
    message_of(&links, &["chunk [0, 0, 1]", "No such file"]);
}

/// An image of version 2, in a folder that is removed when it is dropped.
fn small_image() -> (tempfile::TempDir, PathBuf, Array) {
    let folder = folder();
    let array = textured([8, 8, 8], VoxelType::U8);
    let zarr = Zarr::new(false, &[8; 3], Codec::Gzip);
    let path = zarr.write(&folder.path().join("v"), "zyx", &[8; 3], &array);
    (folder, path, array)
}

#[test]
fn metadata_may_be_long() {
    let (_folder, path, array) = small_image();
    let attributes = path.join(".zattrs");
    let text = fs::read_to_string(&attributes).unwrap();
    let colours = "{\"label-value\":1,\"rgba\":[1,2,3,255]},".repeat(40_000);
    let labels = format!("{{\"image-label\":{{\"colors\":[{colours}0]}},");
    fs::write(&attributes, text.replacen('{', &labels, 1)).unwrap();
    assert_eq!(values(&plain(&path)), array.values);
    let file = fs::File::options().write(true).open(&attributes).unwrap();
    file.set_len(17 << 20).unwrap();
    message_of(&path, &[".zattrs is longer than 16777216 bytes"]);
}

/// Python writes NaN and infinities, which JSON does not have.
#[test]
fn bare_numbers_in_attributes_are_no_obstacle() {
    let (_folder, path, array) = small_image();
    let attributes = path.join(".zattrs");
    let text = fs::read_to_string(&attributes).unwrap();
    let bare = r#"{"note \\\" NaN": [NaN, -Infinity, Infinity, "Infinity \\"],"#;
    fs::write(&attributes, text.replacen('{', bare, 1)).unwrap();
    let volume = plain(&path);
    assert_eq!(values(&volume), array.values);
    fs::write(&attributes, text.replacen('{', "{\"note\": NoNumber,", 1)).unwrap();
    message_of(&path, &[".zattrs: expected"]);
}

/// Nearly all of it was never written, and it is too large to be kept in memory.
#[test]
fn a_chunk_that_changes_after_opening_is_refused() {
    let folder = folder();
    let array = textured([16, 16, 16], VoxelType::U8);
    let zarr = Zarr::new(false, &[8, 16, 16], Codec::Plain);
    let path = zarr.write(&folder.path().join("v"), "zyx", &[16, 16, 16], &array);
    let metadata = path.join("s0/.zarray");
    let text = fs::read_to_string(&metadata).unwrap();
    fs::write(&metadata, text.replace("[16,16,16]", "[400,400,400]")).unwrap();
    let volume = plain(&path);
    let chunk = path.join("s0/1/0/0");
    let bytes = fs::read(&chunk).unwrap();
    fs::write(&chunk, &bytes[1..]).unwrap();
    let message = volume.voxels().unwrap_err().to_string();
    assert!(message.contains("changed since it was opened"), "{message}");
}
