//! NRRD: an input is the one file, or a header beside a file of voxels.

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
    let oriented = "space: LPS\nspace directions: (1,0,0) (0,2,0) (0,0,-3)\nkey:=value\n";
    let detached = "line skip: 1\nbyte skip: -1\nspacings: 1 2 3\ndata file: data.bin\n";
    let gigabyte = Array {
        dims: [1024, 1024, 1000],
        ..Array::new([16, 16, 8], VoxelType::U8, Endian::Little)
    };
    let vectors = integers.nrrd_header("raw", "kinds: vector domain domain domain\n\n");
    let vectors = vectors.replace("dimension: 3", "dimension: 4");
    let vectors = vectors.replace("4 3 2", "2 2 3 2");
    [
        (16, [vectors.into_bytes(), integers.bytes()].concat()),
        (0, integers.nrrd("raw", oriented)),
        // It holds less than it says.
        (0, gigabyte.nrrd("gzip", "spacings: 1 1 1\n")),
        (0, floats.nrrd("gzip", "byte skip: 0\nspacings: 1 1 1\n")),
        (
            0,
            floats.nrrd(
                "bzip2",
                "space: right-anterior-superior\nspace origin: (0,0,0)\n",
            ),
        ),
        (8, integers.nrrd_header("raw", detached).into()),
    ]
    .map(|(options, file)| [&[options], &file[..]].concat())
    .into()
}

fn parse(bytes: &[u8]) {
    let Some((more, mut overrides, file)) = volume::options(bytes) else {
        return;
    };
    let path = folder::write(["v.nrrd", "v.nhdr"][usize::from(more & 1)], file);
    overrides.channel = (more & 2 != 0).then_some(1);
    overrides.time = (more & 4 != 0).then_some(1);
    volume::check(&path, &overrides, volume::allowed(file.len() + DATA.len()));
}

target!(seeds, parse);
