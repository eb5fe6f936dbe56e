//! Which macrocells matter to the cache: those where the medium scatters, and in `full` light those
//! where a surface shows. (In `local` light a cache has to outlive isovalues.) The plan has to know the cache's size before anything is on the GPU, so this is worked out on the CPU; the
//! shaders' ranges and majorants are the same, voxel by voxel.

use std::thread;

use super::constants::TransferPoint;
use super::shared::{Clip, MACROCELL, SceneConstants, Surface};
use crate::scene::volume::{Volume, Voxels};

pub struct Occupancy {
    /// Macrocells along each axis.
    pub macrocells: [u32; 3],
    /// x fastest.
    pub occupied: Vec<bool>,
}

/// Smallest and largest stored value in each macrocell, x fastest.
pub fn macrocell_ranges(volume: &Volume, macrocells: [u32; 3]) -> Vec<[f32; 2]> {
    match &volume.voxels {
        Voxels::U8(v) => ranges(v, volume.dims, macrocells, |v| v as f32),
        Voxels::U16(v) => ranges(v, volume.dims, macrocells, |v| v as f32),
        Voxels::F32(v) => ranges(v, volume.dims, macrocells, |v| v),
    }
}

/// Slices of macrocells are shared out among as many threads as there are cores.
fn ranges<T: Copy + Sync + PartialOrd>(
    voxels: &[T],
    dims: [u32; 3],
    macrocells: [u32; 3],
    stored: fn(T) -> f32,
) -> Vec<[f32; 2]> {
    let slice = (macrocells[0] * macrocells[1]) as usize;
    let mut all = vec![[0.0; 2]; slice * macrocells[2] as usize];
    let threads = thread::available_parallelism().map_or(1, |n| n.get());
    let share = (macrocells[2] as usize).div_ceil(threads);
    thread::scope(|scope| {
        for (n, part) in all.chunks_mut(share * slice).enumerate() {
            scope.spawn(move || {
                for (z, slice) in part.chunks_mut(slice).enumerate() {
                    let z = (n * share + z) as u32;
                    range_slice(voxels, dims, macrocells, z, stored, slice);
                }
            });
        }
    });
    all
}

/// The voxels that the cells of macrocell m interpolate along an axis: m·B − 1 … m·B + B − 1.
fn corners(macrocell: u32, dim: u32) -> std::ops::Range<usize> {
    let low = (macrocell * MACROCELL).max(1) - 1;
    let high = (macrocell * MACROCELL + MACROCELL).min(dim);
    low as usize..high as usize
}

fn range_slice<T: Copy + PartialOrd>(
    voxels: &[T],
    dims: [u32; 3],
    macrocells: [u32; 3],
    z: u32,
    stored: fn(T) -> f32,
    slice: &mut [[f32; 2]],
) {
    let [width, height] = [dims[0] as usize, dims[1] as usize];
    for y in 0..macrocells[1] {
        for x in 0..macrocells[0] {
            let columns = corners(x, dims[0]);
            let mut low = voxels[0];
            let mut high = low;
            let mut first = true;
            for k in corners(z, dims[2]) {
                for j in corners(y, dims[1]) {
                    let row = (k * height + j) * width;
                    for &v in &voxels[row + columns.start..row + columns.end] {
                        low = if first || v < low { v } else { low };
                        high = if first || v > high { v } else { high };
                        first = false;
                    }
                }
            }
            slice[(y * macrocells[0] + x) as usize] = [stored(low), stored(high)];
        }
    }
}

impl Occupancy {
    pub fn new(
        ranges: &[[f32; 2]],
        constants: &SceneConstants,
        transfer: &[TransferPoint],
        surfaces: &[Surface],
        clips: &[Clip],
    ) -> Occupancy {
        let macrocells = constants.macrocells;
        let matters = |(n, range): (usize, &[f32; 2])| {
            let shows = scatters(*range, constants.density, transfer)
                || surfaces
                    .iter()
                    .any(|s| range[0] < s.value && range[1] >= s.value);
            shows && !is_clipped(place(n, macrocells), constants, clips)
        };
        Occupancy {
            macrocells,
            occupied: ranges.iter().enumerate().map(matters).collect(),
        }
    }

    /// Whether any macrocell that meets the box [low, high] (grid space) is occupied.
    pub fn any(&self, low: [f32; 3], high: [f32; 3]) -> bool {
        let index = |g: f32, a: usize| {
            let cell = (g / MACROCELL as f32).floor().max(0.0) as u32;
            cell.min(self.macrocells[a] - 1)
        };
        let [x, y, z] = [0, 1, 2].map(|a| index(low[a], a)..=index(high[a], a));
        z.into_iter().any(|k| {
            y.clone().any(|j| {
                let row = ((k * self.macrocells[1] + j) * self.macrocells[0]) as usize;
                self.occupied[row + *x.start() as usize..=row + *x.end() as usize].contains(&true)
            })
        })
    }
}

fn place(index: usize, macrocells: [u32; 3]) -> [u32; 3] {
    let [width, height, _] = macrocells.map(|n| n as usize);
    [
        index % width,
        index / width % height,
        index / (width * height),
    ]
    .map(|i| i as u32)
}

/// As in `majorants.comp`: opacity is largest at an end of the range or at a point within.
fn scatters(range: [f32; 2], density: f32, transfer: &[TransferPoint]) -> bool {
    let rounding = 1e-6 * range[0].abs().max(range[1].abs());
    let [low, high] = [range[0] - rounding, range[1] + rounding];
    let within = |p: &&TransferPoint| p.value >= low && p.value <= high;
    density > 0.0
        && (opacity(low, transfer) > 0.0
            || opacity(high, transfer) > 0.0
            || transfer.iter().filter(within).any(|p| p.opacity > 0.0))
}

fn opacity(value: f32, transfer: &[TransferPoint]) -> f32 {
    let next = transfer.partition_point(|p| p.value <= value);
    match (next.checked_sub(1).map(|n| transfer[n]), transfer.get(next)) {
        (Some(low), Some(high)) => {
            let t = (value - low.value) / (high.value - low.value);
            low.opacity + t * (high.opacity - low.opacity)
        }
        (Some(only), None) => only.opacity,
        (None, first) => first.map_or(0.0, |p| p.opacity),
    }
}

/// Whether a clip plane removes all of the macrocell.
fn is_clipped(macrocell: [u32; 3], constants: &SceneConstants, clips: &[Clip]) -> bool {
    clips.iter().any(|clip| {
        let nearest: f32 = (0..3)
            .map(|a| {
                let side = macrocell[a] + (clip.normal[a] < 0.0) as u32;
                let grid = (side * MACROCELL) as f32;
                clip.normal[a] * ((grid - 0.5) * constants.spacing[a] - constants.half_extent[a])
            })
            .sum();
        nearest > clip.offset
    })
}
