//! OpenVDB.

#![no_main]

use isolume::scene::volume::{Endian, Volume, VolumeOverrides, VoxelType};
use isolume_fuzz::vdb_files::{self, ACTIVE_MASK, BLOSC, Grid, Transform, ZIP};
use isolume_fuzz::volume_files::Array;
use isolume_fuzz::{folder, guard, target, volume};

/// Bytes that are asked for on the way of a voxel: of its chunk, of the walk, and of what is made of it.
const BYTES_OF_A_VOXEL: u64 = 32;

fn seeds() -> Vec<Vec<u8>> {
    let reals = Array::new([9, 6, 10], VoxelType::F32, Endian::Little);
    let whole = Array::new([5, 4, 2], VoxelType::I32, Endian::Little);
    let masked = Grid {
        compression: ZIP | ACTIVE_MASK,
        low: [-3, 4093, 2],
        background: reals.values[3],
        inactive: reals.values[..40].to_vec(),
        ..Grid::default()
    };
    let tiled = Grid {
        name: "temperature".into(),
        compression: BLOSC,
        inactive: vec![whole.values[7]],
        has_tiles: true,
        block: Some(([4096, 0, 0], 1.0)),
        transform: Transform::Vectors("UniformScaleTranslateMap", vec![[0.5; 3]; 6]),
        ..Grid::default()
    };
    let half = Grid {
        kind: Some("half"),
        compression: 0,
        ..Grid::default()
    };
    let saved_as_half = Grid {
        is_half: true,
        ..masked.clone()
    };
    let shown = Grid {
        name: "again".into(),
        parent: "density",
        ..Grid::default()
    };
    let vectors = Grid {
        kind: Some("vec3s"),
        ..Grid::default()
    };
    let files = [
        vdb_files::write(&[(masked.clone(), &reals)]),
        vdb_files::write(&[(tiled, &whole), (masked.clone(), &reals)]),
        vdb_files::write(&[(half, &reals)]),
        vdb_files::write(&[(saved_as_half, &reals)]),
        vdb_files::write(&[(vectors, &reals), (masked, &reals), (shown, &reals)]),
    ];
    files.map(|file| [&[0], &file[..]].concat()).into()
}

fn parse(bytes: &[u8]) {
    let Some((more, mut overrides, rest)) = volume::options(bytes) else {
        return;
    };
    let path = folder::write("v.vdb", rest);
    overrides.channel = (more & 1 != 0).then_some(1);
    let allowed = volume::allowed_in_chunks(rest.len());
    // A box may be far larger than what is in it; of such a volume, one voxel is read.
    let one = VolumeOverrides {
        crop: Some([[0; 3], [1; 3]]),
        ..overrides.clone()
    };
    let opened = guard::run(allowed, || Volume::load(&path, &one));
    let is_sparse = opened.is_ok_and(|volume| {
        let dims = volume.storage.levels[0].dims.map(u64::from);
        let voxels = dims.into_iter().fold(1, u64::saturating_mul);
        voxels.saturating_mul(BYTES_OF_A_VOXEL) > allowed as u64
    });
    if !is_sparse {
        volume::check(&path, &overrides, allowed);
    }
}

target!(seeds, parse);
