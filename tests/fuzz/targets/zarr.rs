//! OME-Zarr: an input is a folder.

#![no_main]

use isolume::scene::volume::{Endian, VoxelType};
use isolume_fuzz::volume_files::Array;
use isolume_fuzz::zarr_files::blosc::{Blosc, Inner};
use isolume_fuzz::zarr_files::{Codec, Zarr};
use isolume_fuzz::{archive, folder, target, volume};

fn seeds() -> Vec<Vec<u8>> {
    let array = Array::new([6, 5, 4], VoxelType::U16, Endian::Little);
    let blosc = |inner, shuffle| {
        Codec::Blosc(Blosc {
            inner,
            shuffle,
            is_split: shuffle == 1,
            block: 64,
        })
    };
    let chunk = [2, 5, 6];
    let shards = |codec| Zarr {
        shard: Some(vec![4, 5, 6]),
        has_checksum: codec == Codec::Plain,
        ..Zarr::new(true, &chunk, codec)
    };
    let written = [
        Zarr::new(false, &chunk, blosc(Inner::BloscLz, 1)),
        Zarr::new(false, &chunk, blosc(Inner::Lz4, 4)),
        Zarr::new(false, &chunk, blosc(Inner::Zlib, 2)),
        Zarr::new(true, &chunk, blosc(Inner::Zstd, 1)),
        Zarr::new(false, &chunk, Codec::Gzip),
        Zarr::new(true, &chunk, Codec::Zstd),
        Zarr {
            separator: '.',
            order: vec![2, 1, 0],
            ..Zarr::new(false, &chunk, Codec::Plain)
        },
        shards(Codec::Plain),
        shards(blosc(Inner::Lz4, 1)),
    ];
    let seed = |zarr: &Zarr, array: &Array| {
        let files = archive::of(|folder| {
            zarr.write(folder, "zyx", &[4, 5, 6], array);
        });
        [&[0], &files[..]].concat()
    };
    let mut seeds: Vec<Vec<u8>> = written.iter().map(|zarr| seed(zarr, &array)).collect();
    let mut halves = Array::new([6, 5, 4], VoxelType::F16, Endian::Big);
    halves.values[60..].fill(3.0);
    let half_written = Zarr {
        fill: "NaN".into(),
        unwritten: Some(3.0),
        ..Zarr::new(true, &chunk, Codec::Plain)
    };
    seeds.push(seed(&half_written, &halves));
    seeds
}

fn parse(bytes: &[u8]) {
    let Some((more, mut overrides, rest)) = volume::options(bytes) else {
        return;
    };
    let path = folder::empty("v.zarr");
    archive::unpack(rest, &path);
    overrides.channel = (more & 1 != 0).then_some(1);
    overrides.time = (more & 2 != 0).then_some(1);
    overrides.level = (more & 4 != 0).then_some(1);
    volume::check_if_dense(&path, &overrides, volume::allowed_in_chunks(rest.len()));
}

target!(seeds, parse);
