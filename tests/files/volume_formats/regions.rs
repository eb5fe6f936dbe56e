//! Any region of a volume is read as if the whole had been cut, from every kind of source, and a file
//! that is no longer what was opened is refused.

use std::fs::OpenOptions;
use std::io::Write;
use std::ops::Range;
use std::path::Path;
use std::time::{Duration, SystemTime};

use fastrand::Rng;
use flate2::Compression;
use flate2::write::GzEncoder;
use isolume::scene::volume::{
    Endian, Region, StoredType, Volume, VolumeOverrides, VoxelType, Voxels,
};

use crate::tiff_files::Tiff;
use crate::vdb_files::{self, Grid};
use crate::volume_files::{Array, write};
use crate::volume_formats::every_format::in_every_format;
use crate::volume_formats::{folder, load_bytes, plain, u8s, vdb};
use crate::zarr_files::{Codec, Zarr};

fn bytes(voxels: &Voxels) -> &[u8] {
    match voxels {
        Voxels::U8(voxels) => voxels,
        Voxels::U16(voxels) => bytemuck::cast_slice(voxels),
        Voxels::F32(voxels) => bytemuck::cast_slice(voxels),
    }
}

/// The part of a whole volume's bytes that a region has.
fn cut(whole: &[u8], volume: &Volume, region: Region) -> Vec<u8> {
    let size = volume.stored.bytes();
    let [width, height, _] = volume.dims.map(|n| n as usize);
    let along = |a: usize| -> Range<usize> {
        let low = region.low[a] as usize;
        low..low + region.dims[a] as usize
    };
    let mut cut = Vec::new();
    for k in along(2) {
        for j in along(1) {
            let row = (k * height + j) * width;
            let [begin, end] = [along(0).start, along(0).end].map(|i| (row + i) * size);
            cut.extend_from_slice(&whole[begin..end]);
        }
    }
    cut
}

fn random_region(dims: [u32; 3], rng: &mut Rng) -> Region {
    let low = dims.map(|n| rng.u32(..n));
    let dims = std::array::from_fn(|a| rng.u32(1..=dims[a] - low[a]));
    Region { low, dims }
}

/// Regions at random, one after another through one reader and each on its own, and all pieces.
fn reads_regions(volume: &Volume, whole: &[u8], count: usize) {
    let mut rng = Rng::with_seed(3);
    let mut reader = volume.reader();
    for _ in 0..count {
        let region = random_region(volume.dims, &mut rng);
        let mut read = vec![0; region.voxels() * volume.stored.bytes()];
        let expected = cut(whole, volume, region);
        reader.read(region, &mut read).unwrap();
        assert!(read == expected, "{region:?}");
        read.fill(0);
        volume.read(region, &mut read).unwrap();
        assert!(read == expected, "{region:?}");
    }
    for most_bytes in [1, 50, 1000, 1 << 20, u64::MAX] {
        if whole.len() as u64 / most_bytes > 10_000 {
            continue;
        }
        let (mut reader, mut seen) = (volume.reader(), 0);
        for piece in volume.pieces(most_bytes) {
            let mut read = vec![0; piece.voxels() * volume.stored.bytes()];
            reader.read(piece, &mut read).unwrap();
            assert!(read == cut(whole, volume, piece), "{piece:?}");
            seen += read.len();
        }
        assert_eq!(seen, whole.len());
    }
}

/// Neither a chunk nor a region begins where a leaf does.
#[test]
fn regions_are_cut_from_many_leaves() {
    let array = vdb::blocks([140, 129, 137]);
    let grid = Grid {
        low: [-128, 4099, 5],
        has_tiles: true,
        ..Grid::default()
    };
    let volume = load_bytes("v.vdb", vdb_files::write(&[(grid, &array)]));
    reads_regions(&volume, bytes(&volume.voxels().unwrap()), 10);
}

#[test]
fn regions_are_cut_from_the_whole() {
    for voxel_type in [
        VoxelType::U8,
        VoxelType::I16,
        VoxelType::F16,
        VoxelType::F64,
    ] {
        let folder = folder();
        let array = Array::new([7, 6, 5], voxel_type, Endian::Little);
        for path in in_every_format(folder.path(), &array) {
            for axes in ["RAS", "LAS"] {
                for crop in [None, Some([[1, 0, 2], [6, 6, 5]])] {
                    let overrides = VolumeOverrides {
                        axes: Some(axes.parse().unwrap()),
                        crop,
                        ..Default::default()
                    };
                    let volume = Volume::load(&path, &overrides).unwrap();
                    let whole = volume.voxels().unwrap();
                    reads_regions(&volume, bytes(&whole), 10);
                }
            }
        }
    }
}

/// The same voxels are the same volume, whichever format they come in.
#[test]
fn every_format_is_one_volume() {
    for voxel_type in [
        VoxelType::U16,
        VoxelType::I16,
        VoxelType::F16,
        VoxelType::F32,
    ] {
        let folder = folder();
        let array = Array::new([23, 18, 14], voxel_type, Endian::Little);
        for crop in [None, Some([[3, 0, 1], [20, 17, 12]])] {
            let overrides = VolumeOverrides {
                crop,
                ..Default::default()
            };
            let paths = in_every_format(folder.path(), &array);
            let first = Volume::load(&paths[0], &overrides).unwrap();
            let whole = first.voxels().unwrap();
            for path in &paths {
                let volume = Volume::load(path, &overrides).unwrap();
                let name = path.display();
                assert!(volume.voxels().unwrap() == whole, "{name}");
                assert_eq!(volume.range, first.range, "{name}");
                assert_eq!(
                    volume.macrocell_ranges(),
                    first.macrocell_ranges(),
                    "{name}"
                );
                let histogram = |volume: &Volume| volume.histogram(64).unwrap();
                assert_eq!(histogram(&volume), histogram(&first), "{name}");
                reads_regions(&volume, bytes(&whole), 5);
            }
        }
    }
}

/// Too many voxels to be kept in memory: each chunk that a piece cuts is decoded for it, or was kept.
#[test]
fn chunks_are_read_in_any_order() {
    const DIMS: [u32; 3] = [200, 160, 140];
    let folder = folder();
    let mut array = Array::new(DIMS, VoxelType::F64, Endian::Little);
    let mut rng = Rng::with_seed(8);
    for value in &mut array.values {
        *value = f64::from(rng.u8(..));
    }
    let in_f32: Vec<f32> = array.values.iter().map(|value| *value as f32).collect();
    let expected = Voxels::F32(in_f32);
    let tiles = Tiff {
        tile: Some([96, 64]),
        ..Tiff::default()
    };
    let zarr = Zarr::new(false, &[37, 64, 50], Codec::Plain);
    let shape = [140, 160, 200];
    for path in [
        write(folder.path(), "v.tif", tiles.write(&array)),
        zarr.write(&folder.path().join("v.zarr"), "zyx", &shape, &array),
    ] {
        let volume = plain(&path);
        assert!(volume.voxels().unwrap().into_owned() == expected);
        reads_regions(&volume, bytes(&expected), 3);
        let overrides = VolumeOverrides {
            axes: Some("LAS".parse().unwrap()),
            crop: Some([[20, 30, 10], [180, 150, 130]]),
            ..Default::default()
        };
        let reversed = Volume::load(&path, &overrides).unwrap();
        let whole = reversed.voxels().unwrap();
        let made = Volume::from_values(reversed.dims, [1.0; 3], whole.clone().into_owned());
        assert_eq!(
            reversed.macrocell_ranges(),
            made.unwrap().macrocell_ranges()
        );
        reads_regions(&reversed, bytes(&whole), 3);
    }
}

/// Too many voxels to be kept in memory: going back means inflating again.
#[test]
fn a_compressed_file_is_read_in_any_order() {
    const DIMS: [u32; 3] = [400, 300, 290];
    let voxel = |n: usize| (n % 251) as u8 ^ (n / 120_000) as u8;
    let voxels: Vec<u8> = (0..400 * 300 * 290).map(voxel).collect();
    let folder = folder();
    let array = Array {
        dims: DIMS,
        voxel_type: VoxelType::U8,
        endian: Endian::Little,
        values: Vec::new(),
    };
    let header = array.nrrd_header("gzip", "\n");
    let mut encoder = GzEncoder::new(header.into_bytes(), Compression::fast());
    encoder.write_all(&voxels).unwrap();
    let path = write(folder.path(), "v.nrrd", encoder.finish().unwrap());

    let volume = plain(&path);
    assert!(volume.voxels().unwrap().into_owned() == Voxels::U8(voxels.clone()));
    reads_regions(&volume, &voxels, 3);

    let overrides = VolumeOverrides {
        axes: Some("LAS".parse().unwrap()),
        ..Default::default()
    };
    let reversed = Volume::load(&path, &overrides).unwrap();
    let slices = voxels.chunks(400 * 300).rev();
    let voxels: Vec<u8> = slices.flatten().copied().collect();
    reads_regions(&reversed, &voxels, 3);
    let made = Volume::from_values(DIMS, [1.0; 3], Voxels::U8(voxels)).unwrap();
    assert_eq!(reversed.macrocell_ranges(), made.macrocell_ranges());
}

/// What is found on the way through a file, in its order, is what the volume has in its own.
#[test]
fn a_reversed_file_is_known_like_the_same_voxels_in_order() {
    let mut rng = Rng::with_seed(4);
    let overrides = VolumeOverrides {
        axes: Some("LAS".parse().unwrap()),
        ..Default::default()
    };
    for depth in (1..=17).chain([200]) {
        let folder = folder();
        let mut array = Array::new([21, 150, depth], VoxelType::F32, Endian::Little);
        for value in &mut array.values {
            *value = match rng.u32(..100) {
                0 => f64::NAN,
                n => f64::from(n) + rng.f64(),
            };
        }
        let path = write(folder.path(), "v.nrrd", array.nrrd("raw", ""));
        let reversed = Volume::load(&path, &overrides).unwrap();
        let voxels = reversed.voxels().unwrap().into_owned();
        let made = Volume::from_values(reversed.dims, [1.0; 3], voxels).unwrap();
        assert_eq!(reversed.range, made.range);
        assert_eq!(reversed.macrocell_ranges(), made.macrocell_ranges());
        let histogram = |volume: &Volume| volume.histogram(64).unwrap();
        assert_eq!(histogram(&reversed), histogram(&made));
    }
}

/// The scan takes many pieces, and each of them is shared among the cores.
#[test]
fn large_volumes_are_known_like_small_ones() {
    const DIMS: [u32; 3] = [300, 200, 170];
    let mut rng = Rng::with_seed(5);
    let count = 300 * 200 * 170;
    let stored: Vec<u16> = (0..count).map(|_| rng.u16(..1 << 12)).collect();
    let volume = Volume::from_values(DIMS, [1.0; 3], Voxels::U16(stored.clone())).unwrap();
    let mut counts = vec![0; 1 << 12];
    for &value in &stored {
        counts[value as usize] += 1;
    }
    assert_eq!(volume.range, [0.0, 4095.0]);
    assert_eq!(volume.histogram(1 << 12).unwrap().counts, counts);

    let floats = stored.iter().map(|&value| f32::from(value)).collect();
    let floats = Volume::from_values(DIMS, [1.0; 3], Voxels::F32(floats)).unwrap();
    assert_eq!(floats.macrocell_ranges(), volume.macrocell_ranges());
    let bins = floats.histogram(10).unwrap().counts;
    assert_eq!(bins, volume.histogram(10).unwrap().counts);
}

#[test]
fn a_region_outside_is_refused() {
    let volume = Volume::from_values([3, 2, 1], [1.0; 3], Voxels::U8(vec![7; 6])).unwrap();
    let refused = |low, dims, bytes| {
        let read = volume.read(Region { low, dims }, &mut vec![0; bytes]);
        let message = read.unwrap_err().to_string();
        assert!(message.contains("inside it"), "{message}");
    };
    refused([1, 0, 0], [3, 2, 1], 6);
    refused([0, 0, 0], [3, 2, 1], 5);
    refused([0, 0, 1], [3, 2, 0], 0);
    refused([u32::MAX, 0, 0], [2, 1, 1], 2);
}

fn refuses_to_read(volume: &Volume, path: &Path) {
    assert_eq!(volume.stored, StoredType::U8);
    let mut bytes = vec![0; Region::whole(volume.dims).voxels()];
    match volume.read(Region::whole(volume.dims), &mut bytes) {
        Err(error) if error.is_about_input() => {
            let message = error.to_string();
            let name = path.file_name().unwrap().to_str().unwrap();
            assert!(message.contains(name), "{message}");
            assert!(message.contains("changed since it was opened"), "{message}");
        }
        other => panic!("{other:?}"),
    }
}

#[test]
fn a_file_that_changes_after_opening_is_refused() {
    let folder = folder();
    let open = || {
        let path = write(folder.path(), "v.nrrd", u8s().nrrd("raw", ""));
        (plain(&path), path)
    };
    let (volume, path) = open();
    let file = OpenOptions::new().write(true).open(&path).unwrap();
    file.set_len(file.metadata().unwrap().len() - 1).unwrap();
    refuses_to_read(&volume, &path);

    let (volume, path) = open();
    let file = OpenOptions::new().write(true).open(&path).unwrap();
    let later = SystemTime::now() + Duration::from_secs(1);
    file.set_modified(later).unwrap();
    refuses_to_read(&volume, &path);

    let data = write(folder.path(), "v.bin", u8s().bytes());
    let header = u8s().nrrd_header("raw", "data file: v.bin\n");
    let volume = plain(&write(folder.path(), "v.nhdr", header));
    write(folder.path(), "v.bin", [0; 3]);
    refuses_to_read(&volume, &data);
}

/// As long as it is open, it is what it was.
#[cfg(unix)]
#[test]
fn a_file_that_is_replaced_is_still_the_one_that_was_opened() {
    let folder = folder();
    let path = write(folder.path(), "v.nrrd", u8s().nrrd("raw", ""));
    let volume = plain(&path);
    let before = volume.voxels().unwrap().into_owned();
    std::fs::remove_file(&path).unwrap();
    write(folder.path(), "v.nrrd", "another file");
    assert_eq!(volume.voxels().unwrap().into_owned(), before);
}
