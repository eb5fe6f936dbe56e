//! NIfTI: an input is a file, or what is in one that is compressed.

#![no_main]

use isolume::scene::volume::{Endian, VoxelType};
use isolume_fuzz::volume_files::{Array, gzip};
use isolume_fuzz::{folder, target, volume};

fn seeds() -> Vec<Vec<u8>> {
    let mut sform = Array::new([3, 2, 2], VoxelType::F32, Endian::Little).nifti();
    sform.int16(254, 1);
    sform.floats(280, &[1., 0., 0., 0., 0., 2., 0., 0., 0., 0., 3., 0.]);
    let mut qform = Array::new([4, 3, 2], VoxelType::I16, Endian::Big).nifti();
    qform.int16(252, 1);
    qform.floats(256, &[0., 0., 1.]);
    let wide = Array::new([4, 3, 2], VoxelType::U8, Endian::Little).nifti_2();
    let mut times = Array::new([3, 2, 4], VoxelType::U8, Endian::Little).nifti();
    times.int16(40, 4);
    times.int16(46, 2);
    times.int16(48, 2);
    [
        (0, &sform.bytes),
        (64, &times.bytes),
        (0, &qform.bytes),
        (0, &wide.bytes),
        (8, &sform.bytes),
        (16, &gzip(&wide.bytes)),
    ]
    .map(|(options, file)| [&[options], &file[..]].concat())
    .into()
}

fn parse(bytes: &[u8]) {
    let Some((more, mut overrides, file)) = volume::options(bytes) else {
        return;
    };
    let path = match more & 3 {
        0 => folder::write("v.nii", file),
        1 => folder::write("v.nii.gz", &gzip(file)),
        _ => folder::write("v.nii.gz", file),
    };
    overrides.channel = (more & 4 != 0).then_some(1);
    overrides.time = (more & 8 != 0).then_some(1);
    volume::check(&path, &overrides, volume::allowed(file.len()));
}

target!(seeds, parse);
