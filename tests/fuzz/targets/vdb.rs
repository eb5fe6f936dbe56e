//! OpenVDB.

#![no_main]

use isolume::scene::volume::{Endian, VoxelType};
use isolume_fuzz::vdb_files::{self, ACTIVE_MASK, BLOSC, Grid, Transform, ZIP};
use isolume_fuzz::volume_files::Array;
use isolume_fuzz::{folder, target, volume};

/// The most bytes of an input (`tools/fuzz`): what is longer is cut off.
const MOST_BYTES: usize = 16384;

fn seeds() -> Vec<Vec<u8>> {
    let reals = Array::new([9, 6, 10], VoxelType::F32, Endian::Little);
    let halves = Array::new([9, 6, 10], VoxelType::F16, Endian::Little);
    let mut whole = Array::new([17, 4, 9], VoxelType::I32, Endian::Little);
    whole.values[1..].fill(7.0);
    let masked = Grid {
        compression: ZIP | ACTIVE_MASK,
        low: [2, 3, 5],
        background: reals.values[3],
        inactive: reals.values[..40].to_vec(),
        ..Grid::default()
    };
    let tiled = Grid {
        inactive: vec![7.0],
        has_tiles: true,
        block: Some(([4096, 0, 0], 1.0, false)),
        transform: Transform::Vectors("UniformScaleTranslateMap", vec![[0.5; 3]; 6]),
        ..Grid::default()
    };
    let saved_as_half = Grid {
        is_half: true,
        compression: BLOSC | ACTIVE_MASK,
        ..masked.clone()
    };
    let shown = Grid {
        name: "again".into(),
        parent: "density",
        ..Grid::default()
    };
    let vectors = Grid {
        kind: Some("vec3s"),
        parent: "density",
        ..Grid::default()
    };
    let files = [
        vdb_files::write(&[(masked.clone(), &reals)]),
        vdb_files::write(&[(tiled, &whole)]),
        vdb_files::write(&[(Grid::default(), &halves)]),
        vdb_files::write(&[(saved_as_half, &reals)]),
        vdb_files::write(&[(vectors, &reals), (masked, &reals), (shown, &reals)]),
    ];
    let seed = |file: Vec<u8>| {
        assert!(file.len() < MOST_BYTES, "{} bytes", file.len());
        [&[0], &file[..]].concat()
    };
    files.map(seed).into()
}

fn parse(bytes: &[u8]) {
    let Some((more, mut overrides, rest)) = volume::options(bytes) else {
        return;
    };
    let path = folder::write("v.vdb", rest);
    overrides.channel = (more & 1 != 0).then_some(1);
    volume::check_if_dense(&path, &overrides, volume::allowed_in_chunks(rest.len()));
}

target!(seeds, parse);
