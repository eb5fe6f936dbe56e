//! Whatever a file holds, loading it ends soon, without a panic, and without allocating more than
//! the file's length allows.

#[path = "../support/dicom_files.rs"]
mod dicom_files;
#[path = "../support/dicom_scan.rs"]
mod dicom_scan;
#[path = "../support/proper_volume.rs"]
mod proper_volume;
#[path = "../support/tiff_files.rs"]
mod tiff_files;
#[path = "../support/volume_files.rs"]
mod volume_files;
#[path = "../support/zarr_files/mod.rs"]
mod zarr_files;

mod mutation;
mod seeds;

use std::alloc::System;
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::path::Path;
use std::sync::Mutex;
use std::time::{Duration, Instant};

use fastrand::Rng;
use isolume::scene::volume::{Endian, Volume, VolumeOverrides, VoxelType};
use mutation::mutate;
use proper_volume::{allowance, allowance_in_chunks, assert_proper};
use seeds::seeds;
use stats_alloc::{INSTRUMENTED_SYSTEM, Region, StatsAlloc};
use tempfile::TempDir;
use tiff_files::Tiff;
use volume_files::{Array, gzip, write};
use zarr_files::blosc::{Blosc, Inner};
use zarr_files::{Codec, Zarr};

#[global_allocator]
static ALLOCATOR: &StatsAlloc<System> = &INSTRUMENTED_SYSTEM;

/// The counts are the whole process', so tests take turns.
static TURN: Mutex<()> = Mutex::new(());

const INPUTS: usize = 100_000;
/// Of each allowance, whatever the file.
const FIXED: usize = 1 << 20;

/// In memory where the system has such a place: most of the time goes into writing files.
fn folder() -> TempDir {
    tempfile::tempdir_in("/dev/shm")
        .or_else(|_| tempfile::tempdir())
        .unwrap()
}

fn overrides(rng: &mut Rng) -> VolumeOverrides {
    let corner = |rng: &mut Rng| std::array::from_fn(|_| rng.u32(..5));
    VolumeOverrides {
        crop: (rng.u8(..8) == 0).then(|| [corner(rng), corner(rng)]),
        spacing: (rng.u8(..8) == 0).then_some([1.0; 3]),
        ..Default::default()
    }
}

/// Loads a file; true if it is a volume, which then must be a proper one.
fn loads_properly(path: &Path, overrides: &VolumeOverrides) -> bool {
    let Ok(volume) = Volume::load(path, overrides) else {
        return false;
    };
    assert_proper(&volume, volume.voxels().unwrap().len());
    true
}

#[test]
fn mutated_files_neither_panic_nor_hang_nor_ask_for_more_memory_than_they_are_worth() {
    let _turn = TURN.lock();
    let folder = folder();
    let companion = [b"line\n...".as_slice(), &[7; 64]].concat();
    write(folder.path(), "data.bin", &companion);
    let seeds = seeds();
    for seed in &seeds {
        let bytes = if seed.packed_later {
            gzip(&seed.bytes)
        } else {
            seed.bytes.clone()
        };
        let path = write(folder.path(), seed.name, bytes);
        assert!(
            loads_properly(&path, &VolumeOverrides::default()),
            "{}",
            seed.name
        );
    }

    let mut volumes = 0;
    for n in 0..INPUTS {
        let mut rng = Rng::with_seed(n as u64);
        let seed = &seeds[n % seeds.len()];
        let mut bytes = seed.bytes.clone();
        for _ in 0..rng.u8(1..5) {
            mutate(&mut bytes, &mut rng);
        }
        if seed.packed_later {
            bytes = gzip(&bytes);
        }
        let overrides = overrides(&mut rng);
        let path = write(folder.path(), seed.name, &bytes);

        let input = || {
            let header = &bytes[..bytes.len().min(500)];
            format!("input {n}: {}", header.escape_ascii())
        };
        let allowed = allowance(FIXED, bytes.len() + companion.len());
        volumes += usize::from(load_guarded(&path, &overrides, allowed, input));
    }
    // Mutations that always or never spoil a file would test little.
    assert!(
        (INPUTS / 20..INPUTS * 19 / 20).contains(&volumes),
        "{volumes} of {INPUTS} are volumes"
    );
}

#[test]
fn memory_behind_compression_grows_with_what_arrives() {
    let _turn = TURN.lock();
    let folder = folder();
    let mut rng = Rng::with_seed(2);
    let noise: Vec<u8> = (0..1 << 20).map(|_| rng.u8(..)).collect();
    // A megabyte of noise, said to be the beginning of a gigabyte.
    let promise = Array {
        dims: [1024, 1024, 1000],
        voxel_type: VoxelType::U8,
        endian: Endian::Little,
        values: Vec::new(),
    };
    let header = promise.nrrd_header("gzip", "\n");
    let file = [header.as_bytes(), &gzip(&noise)].concat();
    let path = write(folder.path(), "v.nrrd", &file);
    let region = Region::new(ALLOCATOR);
    let message = Volume::load(&path, &VolumeOverrides::default())
        .unwrap_err()
        .to_string();
    let allocated = region.change().bytes_allocated;
    assert!(message.contains("holds 1048576 bytes"), "{message}");
    let allowed = allowance(FIXED, file.len());
    assert!(allocated <= allowed, "{allocated} bytes");
}

/// Loads what is at a path; whether it is a volume. Panics, hangs and greed are faults, and name the input.
fn load_guarded(
    path: &Path,
    overrides: &VolumeOverrides,
    allowed: usize,
    input: impl Fn() -> String,
) -> bool {
    let begin = Instant::now();
    let region = Region::new(ALLOCATOR);
    let outcome = catch_unwind(AssertUnwindSafe(|| loads_properly(path, overrides)));
    let allocated = region.change().bytes_allocated;
    let is_volume = outcome.unwrap_or_else(|_| panic!("loading panicked on {}", input()));
    assert!(
        allocated <= allowed,
        "{allocated} > {allowed} bytes for {}",
        input()
    );
    let took = begin.elapsed();
    assert!(took < Duration::from_secs(5), "slow: {}", input());
    is_volume
}

fn noise(dims: [u32; 3], voxel_type: VoxelType) -> Array {
    let mut array = Array::new(dims, voxel_type, Endian::Little);
    let mut rng = Rng::with_seed(9);
    for value in &mut array.values {
        *value = f64::from(rng.u8(0..100) / 50 * 40);
    }
    array
}

#[test]
fn mutated_tiff_files_neither_panic_nor_hang_nor_ask_for_more_memory_than_they_are_worth() {
    let _turn = TURN.lock();
    let folder = folder();
    let array = noise([20, 17, 3], VoxelType::U16);
    let imagej = "ImageJ=1.5\nimages=3\nslices=3\nunit=um\nspacing=2\ncf=0\nc0=-32768.0\nc1=1.0\n";
    let ome = "<OME><Pixels DimensionOrder=\"XYZCT\" SizeZ=\"3\" SizeC=\"1\" SizeT=\"1\"><TiffData IFD=\"0\" \
               PlaneCount=\"3\"/></Pixels></OME>";
    let mut seeds = Vec::new();
    for (compression, predictor, tile, is_big, description) in [
        (tiff_files::PLAIN, 1, None, false, imagej),
        (tiff_files::PLAIN, 1, Some([16, 16]), true, ""),
        (tiff_files::LZW, 2, None, false, ome),
        (tiff_files::DEFLATE, 1, Some([16, 16]), true, imagej),
        (tiff_files::PACKBITS, 1, None, false, ""),
        (tiff_files::ZSTD, 2, None, true, ome),
    ] {
        let tiff = Tiff {
            is_big,
            compression,
            predictor,
            tile,
            rows_per_strip: 9,
            description: description.into(),
            ..Tiff::default()
        };
        seeds.push(tiff.write(&array));
    }
    let mut volumes = 0;
    for n in 0..INPUTS / 2 {
        let mut rng = Rng::with_seed(n as u64);
        let mut bytes = seeds[n % seeds.len()].clone();
        for _ in 0..rng.u8(1..5) {
            mutate(&mut bytes, &mut rng);
        }
        let path = write(folder.path(), "v.tif", &bytes);
        let allowed = allowance_in_chunks(bytes.len());
        let input = || format!("TIFF input {n}");
        volumes += usize::from(load_guarded(&path, &overrides(&mut rng), allowed, input));
    }
    assert!((INPUTS / 100..INPUTS / 2).contains(&volumes), "{volumes}");
}

#[test]
fn mutated_zarr_folders_neither_panic_nor_hang_nor_ask_for_more_memory_than_they_are_worth() {
    let _turn = TURN.lock();
    let folder = folder();
    let array = noise([20, 17, 6], VoxelType::U16);
    let blosc = |inner, shuffle| {
        Codec::Blosc(Blosc {
            inner,
            shuffle,
            is_split: shuffle == 1,
            block: 1024,
        })
    };
    let shards = |codec| Zarr {
        shard: Some(vec![4, 16, 16]),
        has_checksum: codec == Codec::Plain,
        ..Zarr::new(true, &[4, 8, 8], codec)
    };
    let mut seeds = Vec::new();
    for (n, zarr) in [
        Zarr::new(false, &[3, 9, 20], blosc(Inner::BloscLz, 1)),
        Zarr::new(false, &[3, 9, 20], blosc(Inner::Lz4, 4)),
        Zarr::new(true, &[3, 9, 20], blosc(Inner::Zstd, 1)),
        Zarr::new(false, &[3, 9, 20], Codec::Gzip),
        Zarr::new(true, &[3, 9, 20], Codec::Zstd),
        shards(Codec::Plain),
        shards(blosc(Inner::Lz4, 1)),
    ]
    .into_iter()
    .enumerate()
    {
        let path = folder.path().join(n.to_string());
        zarr.write(&path, "zyx", &[6, 17, 20], &array);
        assert!(
            loads_properly(&path, &VolumeOverrides::default()),
            "{zarr:?}"
        );
        let array = if zarr.is_version_3 {
            "s0/zarr.json"
        } else {
            "s0/.zarray"
        };
        let group = if zarr.is_version_3 {
            "zarr.json"
        } else {
            ".zattrs"
        };
        let chunk = if zarr.is_version_3 {
            "s0/c/0/0/0"
        } else {
            "s0/0/0/0"
        };
        seeds.push((path, [array, group, chunk]));
    }
    let mut volumes = 0;
    for n in 0..INPUTS / 2 {
        let mut rng = Rng::with_seed(n as u64);
        let (path, names) = &seeds[n % seeds.len()];
        let name = names[[0, 1, 2, 2][rng.usize(..4)]];
        let original = std::fs::read(path.join(name)).unwrap();
        let mut bytes = original.clone();
        for _ in 0..rng.u8(1..5) {
            mutate(&mut bytes, &mut rng);
        }
        write(path, name, &bytes);
        let files = bytes.len() + 16384;
        let input = || format!("Zarr input {n}: {name}");
        let allowed = allowance_in_chunks(files);
        volumes += usize::from(load_guarded(path, &overrides(&mut rng), allowed, input));
        write(path, name, original);
    }
    assert!((INPUTS / 100..INPUTS / 2).contains(&volumes), "{volumes}");
}
