//! OpenVDB: each number, compression and shape of tree gives the same volume; what is no grid of numbers is refused.
//! `tools/format_check` reads files that OpenVDB itself has written.

use isolume::scene::volume::{Endian, Quantity, Volume, VolumeOverrides, VoxelType};

use crate::vdb_files::{self, ACTIVE_MASK, BLOSC, Grid, Transform, ZIP};
use crate::volume_files::{Array, write};
use crate::volume_formats::{folder, load_bytes, plain, refusal, refuses, values};

const DIMS: [u32; 3] = [21, 18, 35];
/// Neither a leaf nor a node begins here, and the box lies on both sides of a block's end.
const LOW: [i64; 3] = [-5, 4090, 131];

/// Whole numbers that 16 bits hold, of which the lowest are in runs, and the corners' highest.
fn array(voxel_type: VoxelType) -> Array {
    let mut array = Array::new(DIMS, voxel_type, Endian::Little);
    let last = array.values.len() - 1;
    for (n, value) in array.values.iter_mut().enumerate() {
        let is_thin = n / 300 % 2 == 0;
        *value = f64::from((n as u32).wrapping_mul(2_654_435_761) >> 22) + 10.0;
        if is_thin {
            *value = [0.0, -3.0, 3.0, 7.0][n / 90 % 4];
        }
    }
    (array.values[0], array.values[last]) = (1234.0, 1234.0);
    array
}

fn read(grid: Grid, array: &Array) -> Volume {
    load_bytes("v.vdb", vdb_files::write(&[(grid, array)]))
}

#[test]
fn each_number_and_compression_is_the_same_volume() {
    let codecs = [0, ZIP, BLOSC].map(|codec| [codec, codec | ACTIVE_MASK]);
    for compression in codecs.concat() {
        for (voxel_type, is_half) in [
            (VoxelType::F16, false),
            (VoxelType::F16, true),
            (VoxelType::F32, false),
            (VoxelType::F32, true),
            (VoxelType::F64, false),
            (VoxelType::F64, true),
            (VoxelType::I32, false),
            (VoxelType::I32, true),
            (VoxelType::I64, false),
        ] {
            let array = array(voxel_type);
            let grid = Grid {
                is_half,
                compression,
                low: LOW,
                inactive: vec![0.0],
                ..Grid::default()
            };
            let volume = read(grid, &array);
            let case = format!("{voxel_type} {is_half} {compression}");
            assert_eq!(volume.dims, DIMS, "{case}");
            assert!(values(&volume) == array.values, "{case}");
            assert_eq!(volume.voxel_type, voxel_type, "{case}");
            let codec = match compression & (ZIP | BLOSC) {
                0 => None,
                ZIP => Some("deflate"),
                _ => Some("blosc"),
            };
            assert_eq!(volume.storage.compression.as_deref(), codec);
        }
    }
}

/// Of inactive voxels only what differs is stored, in seven ways.
#[test]
fn inactive_voxels_have_their_own_values() {
    for background in [0.0, 3.0, -3.0, 100.0] {
        for inactive in [
            &[][..],
            &[0.0],
            &[3.0],
            &[-3.0],
            &[0.0, 3.0],
            &[3.0, -3.0],
            &[0.0, 3.0, -3.0],
            &[0.0, 3.0, -3.0, 7.0],
        ] {
            for (voxel_type, has_tiles) in [
                (VoxelType::F16, true),
                (VoxelType::F32, false),
                (VoxelType::I32, true),
            ] {
                let array = array(voxel_type);
                let grid = Grid {
                    low: LOW,
                    background,
                    inactive: inactive.to_vec(),
                    has_tiles,
                    ..Grid::default()
                };
                let volume = read(grid, &array);
                let case = format!("{background} {inactive:?} {voxel_type}");
                assert!(values(&volume) == array.values, "{case}");
            }
        }
    }
}

/// Slots of lower and of upper nodes without a child, and places without a node.
#[test]
fn values_may_stand_for_many_voxels() {
    let dims = [140, 129, 137];
    let array = blocks(dims);
    for (background, inactive) in [
        (0.5, vec![]),
        (0.5, vec![0.5]),
        (0.5, vec![0.5, 2.0]),
        // As within and around a level set.
        (5.0, vec![5.0, -5.0]),
        (-7.0, vec![5.0, 0.5]),
        (3.0, vec![-5.0, 5.0, 2.0]),
    ] {
        let grid = Grid {
            background,
            low: [-128, 4096, 0],
            inactive,
            has_tiles: true,
            ..Grid::default()
        };
        let volume = read(grid, &array);
        assert_eq!(volume.dims, dims);
        assert!(values(&volume) == array.values);
    }
}

/// Values that are the same in whole leaves and whole nodes; those of the box's corners are in no run.
pub fn blocks(dims: [u32; 3]) -> Array {
    let mut array = Array::new(dims, VoxelType::F32, Endian::Little);
    let expected = |x: usize, y: usize, z: usize| match (x, y, z) {
        (0, 0, 0) => 9.0,
        (0..128, 0..128, 0..128) => -5.0,
        (0..128, 0..128, _) => 5.0,
        (136.., 0..8, 0..8) => 2.0,
        (128.., 16..24, _) => 0.5,
        (_, 128, _) => 10.0 + (x + z) as f64,
        _ => 1.0,
    };
    let [width, height, _] = dims.map(|size| size as usize);
    for (n, value) in array.values.iter_mut().enumerate() {
        *value = expected(n % width, n / width % height, n / width / height);
    }
    array
}

/// Of a block of 4096³ voxels without a node, only an active one is a part of the volume.
#[test]
fn blocks_of_one_value_are_known() {
    let mut array = Array::new([2, 1, 1], VoxelType::F32, Endian::Little);
    array.values = vec![2.0, 3.0];
    let with_block = |low, block| {
        let grid = Grid {
            low,
            background: 1.0,
            inactive: vec![3.0],
            block: Some(block),
            ..Grid::default()
        };
        vdb_files::write(&[(grid, &array)])
    };
    let volume = load_bytes("v.vdb", with_block([0; 3], ([4096, 0, 0], 5.0, false)));
    assert_eq!((volume.dims, values(&volume)), ([1; 3], vec![2.0]));

    let refused = |block, parts: &[&str]| refuses("v.vdb", with_block([0; 3], block), parts);
    let sparse = "in which nearly all voxels have one value";
    refused(([-4096, 0, 0], 1.0, true), &["4097×4096×4096", sparse]);
    refused(([1 << 20, 0, 0], 1.0, true), &["`density`", sparse]);
    refused(
        ([100, 0, 0], 1.0, false),
        &["[100, 0, 0]", "multiples of 4096"],
    );
    refused(([0; 3], 1.0, false), &["[0, 0, 0]", "each once"]);
}

#[test]
fn the_volume_is_the_box_of_active_voxels() {
    let mut array = Array::new([20, 20, 20], VoxelType::F32, Endian::Little);
    array.values.fill(0.0);
    // (3, 5, 4) and (7, 5, 11)
    let at = |x: usize, y: usize, z: usize| (z * 20 + y) * 20 + x;
    array.values[at(3, 5, 4)] = 1.0;
    array.values[at(7, 5, 11)] = 2.0;
    let grid = Grid {
        inactive: vec![0.0],
        ..Grid::default()
    };
    let volume = read(grid, &array);
    assert_eq!(volume.dims, [5, 1, 8]);
    let mut expected = vec![0.0; 40];
    (expected[0], expected[39]) = (1.0, 2.0);
    assert_eq!(values(&volume), expected);
}

#[test]
fn density_is_shown_unless_another_grid_is_picked() {
    let [cold, dense] = [VoxelType::F32, VoxelType::I32].map(array);
    let named = |name: &str, class| Grid {
        name: name.into(),
        class,
        ..Grid::default()
    };
    let vectors = Grid {
        kind: Some("vec3s"),
        ..named("vel", "staggered")
    };
    let shown = Grid {
        parent: "density",
        transform: Transform::scale([0.5; 3]),
        ..named("again", "level set")
    };
    let file = vdb_files::write(&[
        (named("temperature", "unknown"), &cold),
        (vectors, &cold),
        (named("density", "unknown"), &dense),
        (named("density\u{1e}1", "fog volume"), &cold),
        (shown, &dense),
    ]);
    let folder = folder();
    let path = write(folder.path(), "v.vdb", file);
    let volume = plain(&path);
    assert_eq!(volume.voxel_type, VoxelType::I32);
    assert_eq!(volume.quantity, Some(Quantity::Density));
    assert_eq!(
        volume.storage.channel_names,
        ["temperature", "density", "density", "again"]
    );
    let note = volume.notes.iter().find(|note| note.contains("vel"));
    assert!(note.is_some_and(|note| note.contains("vec3s")));
    let picked = |channel| {
        let overrides = VolumeOverrides {
            channel: Some(channel),
            ..VolumeOverrides::default()
        };
        Volume::load(&path, &overrides)
    };
    let other = picked(0).unwrap();
    assert_eq!((other.voxel_type, other.quantity), (VoxelType::F32, None));
    let fog = picked(2).unwrap();
    assert_eq!(fog.quantity, Some(Quantity::Density));
    let again = picked(3).unwrap();
    assert_eq!(again.quantity, Some(Quantity::Distance));
    assert_eq!(again.spacing, [0.5; 3]);
    assert_eq!(values(&again), values(&volume));
    assert!(picked(4).unwrap_err().to_string().contains("0 to 3"));
}

#[test]
fn transforms_give_the_voxel_size() {
    let array = array(VoxelType::F32);
    let turned = |angle: f64| {
        let (sin, cos) = angle.sin_cos();
        [
            [2.0 * cos, 2.0 * sin, 0.0, 0.0],
            [-0.5 * sin, 0.5 * cos, 0.0, 0.0],
            [0.0, 0.0, 3.0, 0.0],
            [7.0, 8.0, 9.0, 1.0],
        ]
    };
    let moved = |scale: [f64; 3]| [vec![[9.0, 8.0, 7.0]], vec![scale; 5]].concat();
    for (transform, spacing) in [
        (Transform::scale([0.5, 0.25, 2.0]), [0.5, 0.25, 2.0]),
        (
            Transform::Vectors("UniformScaleMap", vec![[0.1; 3]; 5]),
            [0.1; 3],
        ),
        (
            Transform::Vectors("ScaleTranslateMap", moved([1.0, 2.0, 3.0])),
            [1.0, 2.0, 3.0],
        ),
        (
            Transform::Vectors("TranslationMap", vec![[1.0, 2.0, 3.0]]),
            [1.0; 3],
        ),
        (Transform::Affine(turned(0.7)), [2.0, 0.5, 3.0]),
    ] {
        let grid = Grid {
            transform: transform.clone(),
            ..Grid::default()
        };
        let volume = read(grid, &array);
        let difference = (0..3).map(|a| (volume.spacing[a] - spacing[a]).abs());
        assert!(difference.fold(0.0, f64::max) < 1e-12, "{transform:?}");
    }
    // A mirrored axis makes the axes left-handed: the slowest is reversed.
    let grid = Grid {
        transform: Transform::scale([1.0, -1.0, 1.0]),
        ..Grid::default()
    };
    let mirrored = values(&read(grid, &array));
    let slice = (DIMS[0] * DIMS[1]) as usize;
    let reversed: Vec<f64> = array.values.rchunks(slice).flatten().copied().collect();
    assert!(mirrored == reversed);
}

#[test]
fn what_cannot_be_read_is_told() {
    let array = array(VoxelType::F32);
    refuses("v.vdb", [0; 200], &["does not start as an OpenVDB file"]);
    refuses("v.vdb", [], &["does not start as an OpenVDB file"]);
    refuses(
        "v.vdb",
        vdb_files::head(221, true),
        &["file version 221", "222", "write it again"],
    );
    refuses("v.vdb", vdb_files::head(226, true), &["226", "to 225"]);
    refuses("v.vdb", vdb_files::head(224, false), &["as a stream"]);
    refuses("v.vdb", vdb_files::write(&[]), &["no grid", "none at all"]);
    let with = |grid: Grid| vdb_files::write(&[(grid, &array)]);
    let vectors = Grid {
        kind: Some("vec3s"),
        is_half: true,
        ..Grid::default()
    };
    refuses("v.vdb", with(vectors), &["no grid", "`density` (vec3s)"]);
    let empty = Grid {
        inactive: array.values.clone(),
        ..Grid::default()
    };
    refuses("v.vdb", with(empty), &["`density`", "no active voxel"]);
    let unknown = Grid {
        compression: 8,
        ..Grid::default()
    };
    refuses("v.vdb", with(unknown), &["`density`", "compression 0x8"]);
    let frustum = Grid {
        transform: Transform::Vectors("NonlinearFrustumMap", vec![]),
        ..Grid::default()
    };
    refuses("v.vdb", with(frustum), &["NonlinearFrustumMap"]);
    let sheared = Grid {
        transform: Transform::Affine([
            [1.0, 0.0, 0.0, 0.0],
            [0.5, 1.0, 0.0, 0.0],
            [0.0, 0.0, 1.0, 0.0],
            [0.0, 0.0, 0.0, 1.0],
        ]),
        ..Grid::default()
    };
    refuses("v.vdb", with(sheared), &["i and j are sheared"]);
    let orphan = Grid {
        parent: "other",
        ..Grid::default()
    };
    refuses("v.vdb", with(orphan), &["a grid that is not there"]);
    let folder = folder();
    let path = write(folder.path(), "v.vdb", with(Grid::default()));
    let level = VolumeOverrides {
        level: Some(1),
        ..VolumeOverrides::default()
    };
    assert!(refusal(&path, &level).contains("only for TIFF and OME-Zarr"));
}

/// Wherever a file ends, one sentence says so.
#[test]
fn a_truncated_file_is_refused() {
    let file = vdb_files::write(&[(Grid::default(), &array(VoxelType::F32))]);
    for length in (0..file.len()).step_by(97).chain([file.len() - 1]) {
        let message = {
            let folder = folder();
            let path = write(folder.path(), "v.vdb", &file[..length]);
            match Volume::load(&path, &VolumeOverrides::default()) {
                Err(error) => error.to_string(),
                Ok(volume) => volume.voxels().unwrap_err().to_string(),
            }
        };
        let is_told = ["truncated", "damaged", "does not start"];
        let is_told = is_told.iter().any(|part| message.contains(part));
        assert!(is_told && message.contains("v.vdb"), "{length}: {message}");
    }
}
