//! MetaImage: an input is the one file, or a header beside a file of voxels.

#![no_main]

use isolume::scene::volume::{Endian, VoxelType};
use isolume_fuzz::volume_files::Array;
use isolume_fuzz::{folder, target, volume};

/// The file of voxels that headers can name.
const DATA: &[u8] = &[7; 64];

fn seeds() -> Vec<Vec<u8>> {
    folder::write("data.bin", DATA);
    let integers = Array::new([4, 3, 2], VoxelType::I16, Endian::Big);
    let floats = Array::new([3, 2, 2], VoxelType::F32, Endian::Little);
    let matrix = "TransformMatrix = 1 0 0 0 1 0 0 0 1\nElementSpacing = 1 2 3\nAnatomicalOrientation = RAI\n";
    let times = integers.meta_header("ElementNumberOfChannels = 2\n", "LOCAL");
    let times = times.replace("NDims = 3", "NDims = 4");
    let times = times.replace("4 3 2", "2 1 3 2");
    [
        (48, [times.into_bytes(), integers.bytes()].concat()),
        (0, integers.mha(matrix)),
        (
            0,
            floats.mha("CompressedData = True\nElementSize = 1 2 3\nElementNumberOfChannels = 1\n"),
        ),
        (
            8,
            integers.meta_header("HeaderSize = 5\n", "data.bin").into(),
        ),
    ]
    .map(|(options, file)| [&[options], &file[..]].concat())
    .into()
}

fn parse(bytes: &[u8]) {
    let Some((more, mut overrides, file)) = volume::options(bytes) else {
        return;
    };
    let path = folder::write(["v.mha", "v.mhd"][usize::from(more & 1)], file);
    overrides.channel = (more & 2 != 0).then_some(1);
    overrides.time = (more & 4 != 0).then_some(1);
    volume::check(&path, &overrides, volume::allowed(file.len() + DATA.len()));
}

target!(seeds, parse);
