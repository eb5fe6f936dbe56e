//! One volume, written in each format that can hold its numbers.

use std::path::{Path, PathBuf};

use isolume::scene::volume::VoxelType;

use crate::tiff_files::{self, Tiff};
use crate::vdb_files::{self, Grid};
use crate::volume_files::{Array, gzip, write};
use crate::zarr_files::{Codec, Zarr};

pub fn in_every_format(folder: &Path, array: &Array) -> Vec<PathBuf> {
    let mut paths = in_formats_of_any_number(folder, array).to_vec();
    if array.voxel_type != VoxelType::F16 {
        paths.extend(in_formats_without_halves(folder, array));
    }
    if array.voxel_type.is_float() {
        let grid = Grid {
            low: [-3, 4090, 2],
            ..Grid::default()
        };
        paths.push(write(folder, "v.vdb", vdb_files::write(&[(grid, array)])));
    }
    paths
}

fn in_formats_without_halves(folder: &Path, array: &Array) -> [PathBuf; 9] {
    write(folder, "detached.bin", array.bytes());
    let detached = array.nrrd_header("raw", "data file: detached.bin\n");
    [
        write(folder, "raw.nrrd", array.nrrd("raw", "")),
        write(folder, "gzip.nrrd", array.nrrd("gzip", "")),
        write(folder, "bzip2.nrrd", array.nrrd("bzip2", "")),
        write(folder, "v.nhdr", detached),
        write(folder, "raw.mha", array.mha("")),
        write(folder, "zlib.mha", array.mha("CompressedData = True\n")),
        write(folder, "v.nii", array.nifti().bytes),
        write(folder, "v.nii.gz", gzip(&array.nifti().bytes)),
        write(folder, "v2.nii", array.nifti_2().bytes),
    ]
}

fn in_formats_of_any_number(folder: &Path, array: &Array) -> [PathBuf; 7] {
    let [x, y, z] = array.dims;
    // The last size and the last type count, in any case.
    let named = array.voxel_type.to_string().to_uppercase();
    let raw = format!("2x2x2_int8_{x}x{y}x{z}_{named}.RAW");
    let strips = Tiff {
        compression: tiff_files::LZW,
        rows_per_strip: 4,
        ..Tiff::default()
    };
    let tiles = Tiff {
        compression: tiff_files::DEFLATE,
        tile: Some([4, 4]),
        ..Tiff::default()
    };
    let shape = [z, y, x].map(|size| size as usize);
    let shards = Zarr {
        shard: Some(vec![4, 4, 6]),
        ..Zarr::new(true, &[2, 4, 3], Codec::Zstd)
    };
    [
        write(folder, "v.npy", array.npy(1, false)),
        write(folder, &raw, array.bytes()),
        write(folder, "plain.tif", Tiff::default().write(array)),
        write(folder, "strips.tif", strips.write(array)),
        write(folder, "tiles.tif", tiles.write(array)),
        Zarr::new(false, &[2, 4, 3], Codec::Gzip).write(
            &folder.join("a.zarr"),
            "zyx",
            &shape,
            array,
        ),
        shards.write(&folder.join("b.zarr"), "zyx", &shape, array),
    ]
}
