//! TIFF: a folder of files with a page each.

use std::fs::create_dir;

use isolume::scene::volume::{Endian, Volume, VolumeOverrides, VoxelType};

use super::tiff::{ome, textured};
use crate::tiff_files::{DEFLATE, LZW, Tiff, slice};
use crate::volume_files::write;
use crate::volume_formats::{folder, plain, refusal, values};

#[test]
fn a_folder_of_pages_is_sorted_by_number() {
    let folder = folder();
    let array = textured([5, 4, 12], VoxelType::U16, Endian::Little);
    for z in 0..12 {
        let compression = if z % 2 == 0 { LZW } else { DEFLATE };
        let tiff = Tiff {
            compression,
            ..Tiff::default()
        };
        let name = format!("slice {}.TIF", z + 1);
        write(folder.path(), &name, tiff.write(&slice(&array, z)));
    }
    let single = super::folder();
    let page = slice(&array, 0);
    write(single.path(), "page.tif", Tiff::default().write(&page));
    assert_eq!(values(&plain(single.path())), page.values);

    write(folder.path(), "notes.txt", "no page");
    write(folder.path(), "._slice 1.TIF", "no page either");
    create_dir(folder.path().join("slices.tif")).unwrap();
    let volume = plain(folder.path());
    assert_eq!((volume.dims, values(&volume)), ([5, 4, 12], array.values));
    assert_eq!(volume.storage.format, "TIFF pages");

    let odd = textured([4, 4, 1], VoxelType::U16, Endian::Little);
    write(folder.path(), "slice 7.TIF", Tiff::default().write(&odd));
    write(folder.path(), "slice 9.TIF", Tiff::default().write(&odd));
    let message = refusal(folder.path(), &VolumeOverrides::default());
    assert!(
        message.contains("page 7 of 12 (in slice 7.TIF) is 4×4 pixels, expected 5×4"),
        "{message}"
    );
}

#[test]
fn a_damaged_page_of_a_folder_is_named() {
    let array = textured([40, 30, 3], VoxelType::U16, Endian::Little);
    for count in [3, 1] {
        let folder = folder();
        for z in 0..count {
            let tiff = Tiff {
                compression: DEFLATE,
                rows_per_strip: 30,
                ..Tiff::default()
            };
            let mut bytes = tiff.write(&slice(&array, z));
            if z + 1 == count {
                bytes[12..400].fill(0xff);
            }
            write(folder.path(), &format!("s{z}.tif"), bytes);
        }
        let message = refusal(folder.path(), &VolumeOverrides::default());
        let page = format!(
            "page {count} of {count} (in s{}.tif): a chunk of it",
            count - 1
        );
        assert!(message.contains(&page), "{message}");
    }
}

/// As Bio-Formats writes a file for each plane: the XML in each says what all of them are, whatever their names are.
#[test]
fn a_set_of_ome_files_has_the_order_of_its_xml() {
    let array = textured([4, 3, 6], VoxelType::U8, Endian::Little);
    let set = |last: &str| {
        let place = |n: u32| {
            let name = if n == 5 {
                last.into()
            } else {
                format!("p{n}.ome.tif")
            };
            // Names fall as slices rise, and alternate between channels.
            let (c, z) = (n % 2, 2 - n / 2);
            format!(
                "<TiffData FirstC=\"{c}\" FirstZ=\"{z}\" FirstT=\"0\" IFD=\"0\" PlaneCount=\"1\">\
                 <UUID FileName=\"{name}\">urn:uuid:{n}</UUID></TiffData>"
            )
        };
        let data: String = (0..6).map(place).collect();
        let folder = folder();
        let tiff = Tiff {
            description: ome("XYZCT", [3, 2, 1], &data),
            ..Tiff::default()
        };
        tiff.write_files(folder.path(), &array, |n| format!("p{n}.ome.tif"));
        folder
    };
    let folder = set("p5.ome.tif");
    for channel in [0, 1] {
        let overrides = VolumeOverrides {
            channel: Some(channel),
            ..Default::default()
        };
        let volume = Volume::load(folder.path(), &overrides).unwrap();
        let pages = [0, 1, 2].map(|z| slice(&array, 2 * (2 - z) + channel).values);
        assert_eq!(values(&volume), pages.concat());
        assert_eq!(volume.spacing, [500.0, 250.0, 2000.0]);
        assert_eq!(volume.storage.channel_names, ["DAPI", "GFP"]);
    }
    let message = refusal(set("p7.ome.tif").path(), &VolumeOverrides::default());
    let fault = "its OME-XML says that a plane is in p7.ome.tif, which the folder does not hold";
    assert!(message.contains(fault), "{message}");
}

/// As microscopes write a file for each channel. Each describes the set, or none does but a file of XML, or the first file.
#[test]
fn a_set_of_ome_files_may_have_several_pages_in_each() {
    let array = textured([4, 3, 6], VoxelType::U8, Endian::Little);
    // The file of the second channel comes first, and has its slices backwards.
    let data = |last: u32| {
        let forwards =
            "<TiffData FirstC=\"0\"><UUID FileName=\"b.ome.tif\">urn:uuid:0</UUID></TiffData>";
        let backwards = (0..3).map(|z| {
            let page = if z == 0 { last } else { 2 - z };
            format!(
                "<TiffData FirstC=\"1\" FirstZ=\"{z}\" IFD=\"{page}\">\
                 <UUID FileName=\"a.ome.tif\">urn:uuid:1</UUID></TiffData>"
            )
        });
        forwards.to_string() + &backwards.collect::<String>()
    };
    let whole = ome("XYZCT", [3, 2, 1], &data(2));
    let part = |of: &str| {
        format!(
            "<OME xmlns=\"http://www.openmicroscopy.org/Schemas/OME/2016-06\">\
             <BinaryOnly MetadataFile=\"{of}\" UUID=\"urn:uuid:9\"/></OME>"
        )
    };
    let set = |a: &str, b: &str| {
        let folder = folder();
        for (name, description, first) in [("a", a, 3), ("b", b, 0)] {
            let tiff = Tiff {
                description: description.into(),
                ..Tiff::default()
            };
            let pages = [0, 1, 2].map(|z| slice(&array, first + z));
            write(
                folder.path(),
                &format!("{name}.ome.tif"),
                tiff.write_pages(&pages),
            );
        }
        write(folder.path(), "set.companion.ome", &whole);
        folder
    };
    let xml = part("set.companion.ome");
    for folder in [
        set(&whole, &whole),
        set(&xml, &xml),
        set(&part("b.ome.tif"), &whole),
    ] {
        for (channel, pages) in [(0, [0, 1, 2]), (1, [5, 4, 3])] {
            let overrides = VolumeOverrides {
                channel: Some(channel),
                ..Default::default()
            };
            let volume = Volume::load(folder.path(), &overrides).unwrap();
            let pages = pages.map(|page| slice(&array, page).values);
            assert_eq!(values(&volume), pages.concat());
        }
    }
    for (a, fault) in [
        (
            part("none.ome"),
            "the file none.ome, which describes its files, is missing",
        ),
        (
            part("../set.ome"),
            "the file ../set.ome, which describes its files, is missing",
        ),
        (
            ome("XYZCT", [3, 2, 1], &data(3)),
            "a.ome.tif: its OME-XML says that an image is on page 4 of a.ome.tif, which has 3",
        ),
        (
            ome("XYZCT", [3, 3, 1], &data(2)),
            "speaks of 9 planes, but the 2 files of the folder have 6 pages: some are missing",
        ),
        (
            ome(
                "XYZCT",
                [3, 2, 1],
                &data(2).replace("FirstC=\"0\"", "FirstC=\"0\" PlaneCount=\"2\""),
            ),
            "its OME-XML does not say of every plane in which file it is",
        ),
    ] {
        let message = refusal(set(&a, &whole).path(), &VolumeOverrides::default());
        assert!(message.contains(fault), "{message}");
    }
    let first_channel = VolumeOverrides {
        channel: Some(0),
        ..Default::default()
    };
    // A picture that is not of the set comes first, and planes of the own file need no name.
    let own = whole.replace("<UUID FileName=\"b.ome.tif\">urn:uuid:0</UUID>", "");
    let mixed = set(&part("./b.ome.tif"), &own);
    let foreign = textured([7, 9, 1], VoxelType::U16, Endian::Little);
    write(mixed.path(), "MAX.tif", Tiff::default().write(&foreign));
    let pages = [0, 1, 2].map(|page| slice(&array, page).values);
    assert_eq!(
        values(&Volume::load(mixed.path(), &first_channel).unwrap()),
        pages.concat()
    );
    let alone = refusal(
        &set(&whole, &whole).path().join("a.ome.tif"),
        &VolumeOverrides::default(),
    );
    assert!(alone.contains("open the folder that holds"), "{alone}");
}

/// As tifffile writes one plane after another: each describes itself alone.
#[test]
fn a_folder_of_ome_pages_has_their_voxel_size() {
    let array = textured([4, 3, 3], VoxelType::U8, Endian::Little);
    let opened = |description: &str| {
        let folder = folder();
        let tiff = Tiff {
            description: description.into(),
            ..Tiff::default()
        };
        tiff.write_files(folder.path(), &array, |z| format!("z{z}.ome.tif"));
        let volume = plain(folder.path());
        assert_eq!(values(&volume), array.values);
        volume
    };
    let whole = ome("XYZCT", [1, 1, 1], "<TiffData/>");
    let volume = opened(&whole);
    assert_eq!(volume.spacing, [500.0, 250.0, 2000.0]);
    assert_eq!(volume.storage.unit.as_deref(), Some("nm"));
    assert!(volume.notes.is_empty(), "{:?}", volume.notes);
    let flat = opened(&whole.replace("PhysicalSizeZ=\"2\"", ""));
    assert_eq!(flat.spacing, [500.0, 250.0, 500.0]);
    let note = "OME-XML does not state the whole voxel size: it is taken as 500 nm along z; set volume.spacing";
    assert!(flat.notes[0].contains(note), "{:?}", flat.notes);
    let elsewhere = opened("<OME><BinaryOnly MetadataFile=\"all.ome.xml\"/></OME>");
    assert_eq!(elsewhere.spacing, [1.0; 3]);
    let note = "the file all.ome.xml, which describes its files, is missing: each file is taken as a slice";
    assert!(
        elsewhere.notes.iter().any(|told| told == note),
        "{:?}",
        elsewhere.notes
    );
}

#[test]
fn pages_of_a_folder_may_differ_in_byte_order() {
    for voxel_type in [VoxelType::U8, VoxelType::I16, VoxelType::F32] {
        for tile in [None, Some([16, 16])] {
            let folder = folder();
            let mut array = textured([20, 17, 4], voxel_type, Endian::Little);
            for z in 0..4 {
                array.endian = [Endian::Big, Endian::Little][z as usize % 2];
                let tiff = Tiff {
                    tile,
                    ..Tiff::default()
                };
                let page = tiff.write(&slice(&array, z));
                write(folder.path(), &format!("{z}.tif"), page);
            }
            assert_eq!(values(&plain(folder.path())), array.values, "{voxel_type}");
        }
    }
}
