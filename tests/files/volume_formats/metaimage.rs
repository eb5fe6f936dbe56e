//! MetaImage: orientation, foreign headers, rescaling.

use isolume::scene::volume::{Endian, StoredType, VoxelType};

use crate::volume_files::{Array, gzip, write};
use crate::volume_formats::{DIMS, folder, load_bytes, plain, refuses, u8s, values};

#[test]
fn metaimage_orientation_is_the_matrix_in_lps() {
    let letters = |more: &str| {
        load_bytes("v.mha", u8s().mha(more))
            .axes
            .map(|axes| axes.to_string())
    };
    assert_eq!(letters(""), None);
    let identity = "TransformMatrix = 1 0 0 0 1 0 0 0 1\n";
    assert_eq!(letters(identity).as_deref(), Some("LPS"));
    // As ITK writes it: letters say where axes come from.
    assert_eq!(
        letters(&format!("{identity}AnatomicalOrientation = RAI\n")).as_deref(),
        Some("LPS")
    );
    assert_eq!(
        letters("AnatomicalOrientation = RAI\n").as_deref(),
        Some("LPS")
    );
    assert_eq!(
        letters(&format!("{identity}AnatomicalOrientation = ???\n")),
        None
    );
    let sagittal = "TransformMatrix = 0 1 0 0 0 -1 -1 0 0\n";
    assert_eq!(letters(sagittal).as_deref(), Some("PIR"));
    let mirrored = load_bytes("v.mha", u8s().mha("TransformMatrix = 1 0 0 0 1 0 0 0 -1\n"));
    assert_eq!(mirrored.axes.unwrap().to_string(), "LPS");
    assert!(mirrored.notes[0].contains("LPI became LPS"));
}

#[test]
fn metaimage_skips_a_foreign_header() {
    let array = u8s();
    let folder = folder();
    write(
        folder.path(),
        "v.bin",
        [b"seventeen letters".as_slice(), &array.bytes()].concat(),
    );
    for size in ["17", "-1"] {
        let header = array.meta_header(&format!("HeaderSize = {size}\n"), "v.bin");
        let volume = plain(&write(folder.path(), "v.mhd", header));
        assert_eq!(values(&volume), array.values);
    }
}

#[test]
fn metaimage_takes_gzip_where_zlib_is_usual() {
    let array = u8s();
    let folder = folder();
    for foreign in ["", "seventeen letters"] {
        let bytes = [foreign.as_bytes(), &gzip(&array.bytes())].concat();
        write(folder.path(), "v.zraw", bytes);
        let more = format!("CompressedData = True\nHeaderSize = {}\n", foreign.len());
        let header = array.meta_header(&more, "v.zraw");
        let volume = plain(&write(folder.path(), "v.mhd", header));
        assert_eq!(values(&volume), array.values, "{foreign}");
        let compression = volume.storage.compression.as_deref();
        assert_eq!(compression, Some("gzip"), "{foreign}");
    }
    let header = array.meta_header("CompressedData = True\n", "LOCAL");
    let bytes = [header.as_bytes(), &gzip(&array.bytes())].concat();
    assert_eq!(values(&load_bytes("v.mha", bytes)), array.values);
}

#[test]
fn metaimage_keys_may_end_in_a_colon() {
    let array = u8s();
    let more = "Comment = from 9:30 to 10:00\nElementSpacing = 1 2 3\n";
    let header = array.meta_header(more, "LOCAL");
    let colons = header
        .replace("DimSize =", "DimSize:")
        .replace("ElementSpacing =", "ElementSpacing :")
        .replace("ElementDataFile =", "ElementDataFile:");
    assert!(colons.matches(':').count() == 5, "{colons}");
    let volume = load_bytes("v.mha", [colons.as_bytes(), &array.bytes()].concat());
    assert_eq!((volume.dims, volume.spacing), (DIMS, [1.0, 2.0, 3.0]));
    assert_eq!(values(&volume), array.values);
    let neither = header.replace("DimSize =", "DimSize");
    refuses("v.mha", neither, &["expected `Key = value`"]);
}

#[test]
fn metaimage_voxels_are_local_in_any_case() {
    for local in ["LOCAL", "Local", "local"] {
        let bytes = [u8s().meta_header("", local).as_bytes(), &u8s().bytes()].concat();
        assert_eq!(values(&load_bytes("v.mha", bytes)), u8s().values);
    }
}

#[test]
fn metaimage_refuses_what_is_no_scalar_volume() {
    let text = |from: &str, to: &str| u8s().meta_header("", "LOCAL").replace(from, to);
    refuses("v.mha", text("NDims = 3", "NDims = 2"), &["`NDims` is `2`"]);
    refuses(
        "v.mha",
        u8s().mha("ElementNumberOfChannels = 0\n"),
        &["`ElementNumberOfChannels` is `0`"],
    );
    refuses(
        "v.mha",
        text("BinaryData = True", "BinaryData = False"),
        &["BinaryData"],
    );
    refuses("v.mha", text("UCHAR", "UCHAR_ARRAY"), &["`ElementType` is"]);
    refuses(
        "v.mhd",
        text("LOCAL", "LIST"),
        &["`ElementDataFile` is `LIST`"],
    );
    refuses(
        "v.mhd",
        text("LOCAL", "slice%03d.raw 1 9 1"),
        &["`ElementDataFile`"],
    );
    refuses(
        "v.mhd",
        text("LOCAL", "gone.raw"),
        &["data file", "gone.raw", "No such file"],
    );
}

#[test]
fn metaimage_rescales_small_integers_in_their_width() {
    let more = "ElementToIntensityFunctionSlope = 2\nElementToIntensityFunctionOffset = -3\n";
    let volume = load_bytes(
        "v.mha",
        Array::new(DIMS, VoxelType::I8, Endian::Little).mha(more),
    );
    assert!(volume.stored == StoredType::U8);
    assert_eq!(volume.range, [-259.0, 251.0]);
    let zero = u8s().mha("ElementToIntensityFunctionSlope = 0\n");
    refuses("v.mha", zero, &["slope 0"]);
}
