//! TIFF: each way in which a stack may be written gives the same volume, and OME's descriptions are understood.

use fastrand::Rng;
use isolume::scene::volume::{Endian, Volume, VolumeOverrides, VoxelType};

use crate::tiff_files::{DEFLATE, LZW, PACKBITS, PLAIN, Tiff, ZSTD, slice};
use crate::volume_files::{Array, write};
use crate::volume_formats::{folder, load_bytes, plain, refuses, round_trip_with_halves, values};

pub const CODECS: [u16; 5] = [PLAIN, LZW, DEFLATE, PACKBITS, ZSTD];

#[test]
fn each_type_and_byte_order_round_trips() {
    for is_big in [false, true] {
        round_trip_with_halves(|folder, array| {
            let tiff = Tiff {
                is_big,
                ..Tiff::default()
            };
            write(folder, "v.tif", tiff.write(array))
        });
    }
}

#[test]
fn each_codec_round_trips() {
    for compression in CODECS {
        round_trip_with_halves(|folder, array| {
            let tiff = Tiff {
                compression,
                ..Tiff::default()
            };
            write(folder, "v.tiff", tiff.write(array))
        });
    }
}

pub fn textured(dims: [u32; 3], voxel_type: VoxelType, endian: Endian) -> Array {
    let mut array = Array::new(dims, voxel_type, endian);
    let mut rng = Rng::with_seed(7);
    for (n, value) in array.values.iter_mut().enumerate() {
        *value = if rng.bool() {
            f64::from(rng.u8(0..128))
        } else {
            (n / 40 % 100) as f64
        };
    }
    array
}

#[test]
fn strips_tiles_and_predictors_are_one_volume() {
    for voxel_type in [
        VoxelType::U8,
        VoxelType::U16,
        VoxelType::I32,
        VoxelType::F16,
        VoxelType::F32,
    ] {
        for endian in [Endian::Little, Endian::Big] {
            let array = textured([37, 29, 3], voxel_type, endian);
            let cuts = [
                (None, 29),
                (None, 5),
                (Some([16, 16]), 0),
                (Some([64, 48]), 0),
            ];
            for (tile, rows_per_strip) in cuts {
                for compression in CODECS {
                    for predictor in 1..=if voxel_type.is_float() { 3 } else { 2 } {
                        let tiff = Tiff {
                            compression,
                            predictor,
                            tile,
                            rows_per_strip,
                            ..Tiff::default()
                        };
                        let volume = load_bytes("v.tif", tiff.write(&array));
                        assert_eq!(values(&volume), array.values, "{tiff:?}");
                    }
                }
            }
        }
    }
}

#[test]
fn a_palette_is_told() {
    let tiff = Tiff {
        photometric: 3,
        ..Tiff::default()
    };
    let array = textured([5, 4, 2], VoxelType::U8, Endian::Little);
    let folder = folder();
    let volume = plain(&write(folder.path(), "v.tif", tiff.write(&array)));
    assert_eq!(values(&volume), array.values);
    assert!(volume.notes[0].contains("palette"), "{:?}", volume.notes);
}

#[test]
fn a_last_strip_may_be_padded() {
    let array = textured([37, 29, 2], VoxelType::U16, Endian::Little);
    for compression in CODECS {
        let tiff = Tiff {
            compression,
            rows_per_strip: 28,
            pads_strips: true,
            ..Tiff::default()
        };
        let volume = load_bytes("v.tif", tiff.write(&array));
        assert_eq!(values(&volume), array.values, "{compression}");
    }
}

pub fn ome(order: &str, sizes: [u32; 3], data: &str) -> String {
    let [z, c, t] = sizes;
    format!(
        "<?xml version=\"1.0\" encoding=\"UTF-8\"?><OME xmlns=\"http://www.openmicroscopy.org/Schemas/OME/2016-06\">\
         <Image ID=\"Image:0\" Name=\"Doe^Jane\"><Pixels ID=\"Pixels:0\" DimensionOrder=\"{order}\" Type=\"uint8\" \
         SizeX=\"4\" SizeY=\"3\" SizeZ=\"{z}\" SizeC=\"{c}\" SizeT=\"{t}\" PhysicalSizeX=\"500\" \
         PhysicalSizeXUnit=\"nm\" PhysicalSizeY=\"0.25\" PhysicalSizeZ=\"2\" PhysicalSizeZUnit=\"µm\">\
         <Channel ID=\"Channel:0:0\" Name=\"DAPI\"/><Channel ID=\"Channel:0:1\" Name=\"GFP\"/>{data}\
         </Pixels></Image></OME>"
    )
}

#[test]
fn ome_says_what_each_page_is() {
    let array = textured([4, 3, 12], VoxelType::U8, Endian::Little);
    let reversed: String = (0..12)
        .map(|n| {
            let (c, z, t) = (n % 2, n / 2 % 3, n / 6);
            format!(
                "<TiffData FirstC=\"{c}\" FirstZ=\"{z}\" FirstT=\"{t}\" IFD=\"{}\"/>",
                11 - n
            )
        })
        .collect();
    type Page = fn(u32, u32, u32) -> u32;
    let cases: [(&str, &str, Page); 3] = [
        ("XYZCT", "<TiffData/>", |c, t, z| (t * 2 + c) * 3 + z),
        (
            "XYCZT",
            "<TiffData IFD=\"0\" PlaneCount=\"12\"/>",
            |c, t, z| (t * 3 + z) * 2 + c,
        ),
        ("XYCZT", &reversed, |c, t, z| 11 - ((t * 3 + z) * 2 + c)),
    ];
    for (order, data, page) in cases {
        let tiff = Tiff {
            description: ome(order, [3, 2, 2], data),
            ..Tiff::default()
        };
        let folder = folder();
        let path = write(folder.path(), "v.ome.tif", tiff.write(&array));
        for (channel, time) in [(0, 0), (1, 0), (0, 1), (1, 1)] {
            let overrides = VolumeOverrides {
                channel: Some(channel),
                time: Some(time),
                ..Default::default()
            };
            let volume = Volume::load(&path, &overrides).unwrap();
            let pages = [0, 1, 2].map(|z| slice(&array, page(channel, time, z)).values);
            assert_eq!(values(&volume), pages.concat(), "{order} {data}");
            assert_eq!(volume.spacing, [500.0, 250.0, 2000.0]);
            assert_eq!(volume.storage.unit.as_deref(), Some("nm"));
            assert_eq!(volume.storage.channel_names, ["DAPI", "GFP"]);
            assert!(!format!("{volume:?}").contains("Doe"));
        }
    }
    let tiff = Tiff {
        description: ome("XYZCT", [13, 1, 1], ""),
        ..Tiff::default()
    };
    refuses(
        "v.ome.tif",
        tiff.write(&array),
        &["12 pages", "speaks of 13"],
    );
}

#[test]
fn a_size_of_0_in_ome_is_none() {
    let array = textured([4, 3, 2], VoxelType::U8, Endian::Little);
    let description = ome("XYZCT", [2, 1, 1], "<TiffData/>");
    let mut tiff = Tiff {
        description: description.replace("PhysicalSizeZ=\"2\"", "PhysicalSizeZ=\"0.0\""),
        ..Tiff::default()
    };
    let volume = load_bytes("v.ome.tif", tiff.write(&array));
    assert_eq!(volume.spacing, [500.0, 250.0, 500.0]);
    for note in [
        "`PhysicalSizeZ` is 0, and counts as not stated",
        "it is taken as 500 nm along z",
    ] {
        let is_told = volume.notes.iter().any(|told| told.contains(note));
        assert!(is_told, "{note}: {:?}", volume.notes);
    }
    tiff.description = description.replace(
        "PhysicalSizeX=\"500\" PhysicalSizeXUnit=\"nm\" PhysicalSizeY=\"0.25\"",
        "",
    );
    let volume = load_bytes("v.ome.tif", tiff.write(&array));
    assert_eq!(
        volume.spacing, [2.0; 3],
        "only the slices' distance is stated"
    );
    assert_eq!(volume.storage.unit.as_deref(), Some("µm"));
    tiff.description = description.replace("</OME>", "<Image><Pixels/></Image></OME>");
    let volume = load_bytes("v.ome.tif", tiff.write(&array));
    let note = "the file holds another image, which is not shown";
    assert!(volume.notes[0].contains(note), "{:?}", volume.notes);
    tiff.description = description.replace("PhysicalSizeZ=\"2\"", "PhysicalSizeZ=\"-2\"");
    let bytes = tiff.write(&array);
    refuses("v.ome.tif", bytes, &["`PhysicalSizeZ` is `-2`", "above 0"]);
}
