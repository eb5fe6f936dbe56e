//! OME-Zarr that is damaged, promises too much, or is no image.

use std::fs;
use std::path::Path;

use isolume::scene::volume::{Volume, VoxelType};

use super::zarr::{message_of, textured};
use crate::volume_formats::folder;
use crate::zarr_files::{Codec, Zarr};

#[test]
fn what_is_no_image_is_refused() {
    let folder = folder();
    let array = textured([8, 8, 8], VoxelType::U16);
    let make =
        |name: &str, zarr: &Zarr| zarr.write(&folder.path().join(name), "zyx", &[8, 8, 8], &array);
    let change = |path: &Path, from: &str, to: &str| {
        let text = fs::read_to_string(path).unwrap();
        assert!(text.contains(from), "{text}");
        fs::write(path, text.replace(from, to)).unwrap();
    };
    let zarr = Zarr::new(true, &[4, 4, 4], Codec::Zstd);
    let path = make("snappy", &zarr);
    change(&path.join("s0/zarr.json"), "\"zstd\"", "\"lzma\"");
    message_of(
        &path,
        &["s0", "`compressor` is `lzma`", "blosc, zstd, gzip"],
    );

    let path = make("axes", &zarr);
    change(
        &path.join("zarr.json"),
        "\"name\":\"z\"",
        "\"name\":\"lambda\"",
    );
    message_of(&path, &["`axes` is `lambda`", "t, c, z, y, x"]);

    let path = make("wide", &zarr);
    change(
        &path.join("s0/zarr.json"),
        "\"fill_value\":0",
        "\"fill_value\":\"0x10000\"",
    );
    message_of(
        &path,
        &["`fill_value` is `\"0x10000\"`", "of the array's type"],
    );

    for (n, number) in ["-1", "65536", "0.5", "1e30"].into_iter().enumerate() {
        let path = make(&format!("beyond {n}"), &zarr);
        let fill = format!("\"fill_value\":{number}");
        change(&path.join("s0/zarr.json"), "\"fill_value\":0", &fill);
        message_of(&path, &["`fill_value` is", "of the array's type"]);
    }

    let path = make("outside", &zarr);
    change(&path.join("zarr.json"), "\"s0\"", "\"../s0\"");
    message_of(&path, &["`path` is `../s0`", "inside"]);

    let path = make("gone", &zarr);
    fs::remove_dir_all(path.join("s0/c")).unwrap();
    message_of(&path, &["its chunks are 0 bytes", "missing"]);

    let path = make("damaged", &zarr);
    let chunk = path.join("s0/c/1/0/1");
    let bytes = fs::read(&chunk).unwrap();
    fs::write(&chunk, &bytes[..bytes.len() / 2]).unwrap();
    message_of(&path, &["chunk [1, 0, 1]", "zstd"]);

    let checked = Zarr {
        has_checksum: true,
        ..zarr.clone()
    };
    let path = make("checked", &checked);
    let chunk = path.join("s0/c/0/1/1");
    let mut bytes = fs::read(&chunk).unwrap();
    bytes[20] ^= 1;
    fs::write(&chunk, &bytes).unwrap();
    message_of(&path, &["chunk [0, 1, 1]", "checksum"]);

    let path = make("huge", &zarr);
    change(&path.join("s0/zarr.json"), "[8,8,8]", "[4000,4000,400000]");
    message_of(&path, &["cannot hold", "400000×4000×4000"]);

    let empty = folder.path().join("empty");
    fs::create_dir(&empty).unwrap();
    message_of(&empty, &["holds no DICOM image"]);
    let plate = folder.path().join("plate");
    fs::create_dir(&plate).unwrap();
    fs::write(plate.join(".zattrs"), "{\"plate\": {\"wells\": []}}").unwrap();
    message_of(&plate, &["plate of images"]);
    let newer = folder.path().join("newer");
    fs::create_dir(&newer).unwrap();
    let multiscales = "{\"multiscales\": [{\"coordinateSystems\": [], \"datasets\": []}]}";
    fs::write(newer.join(".zattrs"), multiscales).unwrap();
    message_of(&newer, &["is OME-Zarr 0.6 or later"]);
    let remote = Path::new("https://example.org/v.zarr");
    message_of(remote, &["address on the network", "download it first"]);
    let listed = Volume::series(remote).unwrap_err().to_string();
    assert!(listed.contains("address on the network"), "{listed}");
}

/// A thumbnail, and a chunk that would lie outside.
#[test]
fn other_files_do_not_stand_for_chunks() {
    let folder = folder();
    let array = textured([8, 8, 8], VoxelType::U8);
    let zarr = Zarr::new(false, &[8, 8, 8], Codec::Plain);
    let path = zarr.write_array(&folder.path().join("v"), &[8, 8, 8], &array);
    let metadata = path.join(".zarray");
    let text = fs::read_to_string(&metadata).unwrap();
    fs::write(&metadata, text.replace("[8,8,8]", "[4096,4096,4096]")).unwrap();
    fs::create_dir(path.join("thumbnails")).unwrap();
    fs::rename(path.join("0/0/0"), path.join("thumbnails/0")).unwrap();
    fs::write(path.join("0/0/1"), [0; 4096]).unwrap();
    message_of(&path, &["its chunks are 0 bytes, decoded"]);
}

#[test]
fn zero_lengths_and_repetitions_are_refused() {
    let folder = folder();
    let array = textured([8, 8, 8], VoxelType::U8);
    let zarr = Zarr::new(true, &[8, 8, 8], Codec::Zstd);
    let write = |axes: &str, arrays: &[&str]| {
        let path = folder.path().join("v");
        zarr.write_array(&path.join("s0"), &[8, 8, 8], &array);
        let arrays: Vec<_> = arrays.iter().map(|name| (*name, vec![1.0; 3])).collect();
        zarr.write_group(&path, axes, &arrays);
        path
    };
    for arrays in [&[][..], &["s0", "s0"], &["s0"; 65]] {
        let path = write("zyx", arrays);
        let found = format!("`datasets` has {} entries", arrays.len());
        message_of(&path, &[&found, "expected 1 to 64"]);
    }
    let path = write("yyx", &["s0"]);
    message_of(&path, &["`axes` is `y, y, x`", "each axis once"]);
    let path = write("ccx", &["s0"]);
    message_of(&path, &["`axes` is `c, c, x`", "x and y"]);
    let path = write("tyx", &["s0"]);
    let metadata = path.join("s0/zarr.json");
    let text = fs::read_to_string(&metadata).unwrap();
    let text = text.replace("\"shape\":[8,8,8]", "\"shape\":[0,8,8]");
    fs::write(&metadata, text).unwrap();
    message_of(
        &path,
        &["the array is [0, 8, 8] voxels, expected at least 1"],
    );
}

/// Shards to which more codecs belong than those of their chunks.
#[test]
fn codecs_around_shards_are_refused_by_name() {
    let folder = folder();
    let array = textured([8, 8, 8], VoxelType::U8);
    let zarr = Zarr {
        shard: Some(vec![8, 8, 8]),
        ..Zarr::new(true, &[4, 4, 4], Codec::Plain)
    };
    let path = zarr.write_array(&folder.path().join("v"), &[8, 8, 8], &array);
    let metadata = path.join("zarr.json");
    let text = fs::read_to_string(&metadata).unwrap();
    let turned = r#""codecs":[{"name":"transpose","configuration":{"order":[2,1,0]}},"#;
    let at = text.rfind("\"codecs\":[").unwrap();
    let at = text
        .find("\"codecs\":[")
        .filter(|first| *first < at)
        .unwrap_or(at);
    let changed = [&text[..at], turned, &text[at + "\"codecs\":[".len()..]].concat();
    fs::write(&metadata, changed).unwrap();
    let found = "`codecs` is `transpose, sharding_indexed`, expected sharding_indexed alone";
    message_of(&path, &[found, "inside it"]);

    let turned = r#""index_codecs":[{"name":"transpose","configuration":{"order":[3,2,1,0]}},"#;
    fs::write(&metadata, text.replace("\"index_codecs\":[", turned)).unwrap();
    message_of(
        &path,
        &["change the order of axes", "expected only bytes and crc32c"],
    );
}
