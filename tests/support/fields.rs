//! Volumes whose voxels follow a formula.

use glam::DVec3;
use isolume::scene::volume::{Volume, Voxels};

/// The indices of a volume's voxels in the order in which they are stored: x runs fastest.
pub fn voxels([width, height, depth]: [u32; 3]) -> impl Iterator<Item = [u32; 3]> {
    (0..width * height * depth).map(move |n| [n % width, n / width % height, n / (width * height)])
}

/// Floats that are a function of their voxel's index.
pub fn indexed_field(
    dims: [u32; 3],
    spacing: [f64; 3],
    value: impl FnMut([u32; 3]) -> f32,
) -> Volume {
    let values = voxels(dims).map(value).collect();
    Volume::from_values(dims, spacing, Voxels::F32(values)).expect("a volume")
}

/// Floats that are a function of where their voxel lies, as seen from the middle of the box, in voxels.
pub fn field(dims: [u32; 3], spacing: [f64; 3], mut value: impl FnMut(DVec3) -> f32) -> Volume {
    let middle = 0.5 * DVec3::from(dims.map(f64::from));
    indexed_field(dims, spacing, |voxel| {
        value(DVec3::from(voxel.map(f64::from)) + 0.5 - middle)
    })
}
