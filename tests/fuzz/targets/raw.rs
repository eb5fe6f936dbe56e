//! Voxels without a header: an input begins with the file's name, which says what they are.

#![no_main]

use isolume::scene::volume::{Endian, VoxelType};
use isolume_fuzz::volume_files::Array;
use isolume_fuzz::{folder, target, volume};

fn seeds() -> Vec<Vec<u8>> {
    [
        VoxelType::U8,
        VoxelType::I16,
        VoxelType::U64,
        VoxelType::F16,
        VoxelType::F32,
        VoxelType::F64,
    ]
    .map(|kind| {
        let voxels = Array::new([4, 3, 2], kind, Endian::Little).bytes();
        [format!("\0v_4x3x2_{kind}\n").as_bytes(), &voxels].concat()
    })
    .into()
}

fn parse(bytes: &[u8]) {
    let Some((more, mut overrides, rest)) = volume::options(bytes) else {
        return;
    };
    let Some(line) = rest.iter().position(|byte| *byte == b'\n') else {
        return;
    };
    let name: String = String::from_utf8_lossy(&rest[..line])
        .chars()
        .filter(|c| !"/\0".contains(*c))
        .take(60)
        .collect();
    overrides.endian = (more & 1 != 0).then_some(Endian::Big);
    let file = &rest[line + 1..];
    let path = folder::empty("raw").join(name + ".raw");
    std::fs::write(&path, file).expect("a file");
    volume::check(&path, &overrides, volume::allowed(file.len()));
}

target!(seeds, parse);
