//! TIFF: an input is a file, or a folder of pages.

#![no_main]

use isolume::scene::volume::{Endian, VoxelType};
use isolume_fuzz::tiff_files::{DEFLATE, LZW, PACKBITS, PLAIN, Tiff, ZSTD};
use isolume_fuzz::volume_files::Array;
use isolume_fuzz::{archive, folder, target, volume};

fn seeds() -> Vec<Vec<u8>> {
    let array = Array::new([5, 4, 2], VoxelType::U16, Endian::Little);
    let imagej = "ImageJ=1.5\nimages=2\nslices=2\nunit=um\nspacing=2\n";
    let ome = "<OME><Pixels DimensionOrder=\"XYZCT\" SizeZ=\"2\" SizeC=\"1\" SizeT=\"1\"><TiffData IFD=\"0\" \
               PlaneCount=\"2\"/></Pixels></OME>";
    let mut seeds = Vec::new();
    for (compression, predictor, tile, is_big, description) in [
        (PLAIN, 1, None, false, imagej),
        (PLAIN, 1, Some([16, 16]), true, ""),
        (LZW, 2, None, false, ome),
        (DEFLATE, 1, Some([16, 16]), true, imagej),
        (PACKBITS, 1, None, false, ""),
        (ZSTD, 2, None, true, ome),
    ] {
        let tiff = Tiff {
            is_big,
            compression,
            predictor,
            tile,
            description: description.into(),
            ..Tiff::default()
        };
        seeds.push([&[0], &tiff.write(&array)[..]].concat());
    }
    let halves = Tiff {
        compression: DEFLATE,
        predictor: 3,
        ..Tiff::default()
    };
    let halves = halves.write(&Array::new([5, 4, 2], VoxelType::F16, Endian::Big));
    seeds.push([&[0], &halves[..]].concat());
    let page = Tiff::default().write(&Array::new([3, 2, 1], VoxelType::U8, Endian::Little));
    let pages = ["1.tif", "2.tif", "10.tif"].map(|name| (name.to_string(), page.clone()));
    seeds.push([&[8], &archive::pack(&pages)[..]].concat());
    seeds
}

fn parse(bytes: &[u8]) {
    let Some((more, mut overrides, rest)) = volume::options(bytes) else {
        return;
    };
    let path = match more & 1 {
        0 => folder::write("v.tif", rest),
        _ => {
            let path = folder::empty("pages");
            archive::unpack(rest, &path);
            path
        }
    };
    overrides.channel = (more & 2 != 0).then_some(1);
    overrides.time = (more & 4 != 0).then_some(1);
    overrides.level = (more & 8 != 0).then_some(1);
    volume::check(&path, &overrides, volume::allowed_in_chunks(rest.len()));
}

target!(seeds, parse);
