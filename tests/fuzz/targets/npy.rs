//! NumPy's arrays.

#![no_main]

use isolume::scene::volume::{Endian, VoxelType};
use isolume_fuzz::volume_files::Array;
use isolume_fuzz::{folder, target, volume};

fn seeds() -> Vec<Vec<u8>> {
    let integers = Array::new([4, 3, 2], VoxelType::I16, Endian::Big);
    let halves = Array::new([3, 2, 2], VoxelType::F16, Endian::Big);
    let floats = Array::new([3, 2, 2], VoxelType::F64, Endian::Little);
    [
        integers.npy(1, false),
        halves.npy(1, false),
        floats.npy(2, true),
    ]
    .map(|file| [&[0], &file[..]].concat())
    .into()
}

fn parse(bytes: &[u8]) {
    let Some((_, overrides, file)) = volume::options(bytes) else {
        return;
    };
    let path = folder::write("v.npy", file);
    volume::check(&path, &overrides, volume::allowed(file.len()));
}

target!(seeds, parse);
