//! The bricks of a volume in which there is something to see.

use crate::render::gpu_scene::GpuScene;
use crate::render::layout::{BrickLayout, Occupancy};
use crate::scene::volume::{BRICK_SIDE, MACROCELL, Volume};

/// Number of bricks in which the medium scatters or a surface shows. Of the others, only those are read that share a block
/// of one majorant with one of them, or lie beside a surface.
pub fn needed_bricks(scene: &GpuScene, volume: &Volume) -> u32 {
    let needed = which_are_needed(scene, volume, BRICK_SIDE);
    needed.into_iter().filter(|&needed| needed).count() as u32
}

/// For each brick of `side` voxels a side, x fastest, whether the medium scatters or a surface shows in it.
pub fn which_are_needed(scene: &GpuScene, volume: &Volume, side: u32) -> Vec<bool> {
    let shown = Occupancy::with_surfaces(&scene.parts, volume);
    let bricks = BrickLayout::count(volume.dims, side);
    // Voxel i is at i + 1 in grid space; a brick ends just before the first voxel behind it.
    let spans: [Vec<_>; 3] = std::array::from_fn(|a| {
        let low = |i: u32| (i * side) as f32;
        let high = |i: u32| (i * side + side) as f32;
        (0..bricks[a])
            .map(|i| shown.span(a, [low(i) + 1.0, high(i) + 1.0 - 1.0 / MACROCELL as f32]))
            .collect()
    });
    let [x, y, z] = &spans;
    let mut needed = Vec::with_capacity(x.len() * y.len() * z.len());
    for z in z {
        for y in y {
            let row = shown.row(y, z);
            needed.extend(x.iter().map(|x| row[x.clone()].contains(&true)));
        }
    }
    needed
}
