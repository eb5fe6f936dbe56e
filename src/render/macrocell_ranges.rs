//! The smallest and largest stored value in each macrocell; once a volume.
//!
//! The CPU finds them: it has to know them before anything is on the GPU, to lay out a cache, and it
//! reads voxels as fast as memory gives them, where a software device fetches texel by texel.

use rayon::prelude::*;

use super::shared::MACROCELL;
use crate::scene::volume::{Volume, Voxels};

/// In the voxels' stored units, x fastest; found when they are first asked for.
pub fn macrocell_ranges(volume: &Volume) -> &[[f32; 2]] {
    volume.macrocell_ranges.get_or_init(|| {
        let macrocells = volume.dims.map(|n| (n + 1).div_ceil(MACROCELL));
        match &volume.voxels {
            Voxels::U8(v) => ranges(v, volume.dims, macrocells),
            Voxels::U16(v) => ranges(v, volume.dims, macrocells),
            Voxels::F32(v) => ranges(v, volume.dims, macrocells),
        }
    })
}

fn ranges<T: Copy + PartialOrd + Sync + Into<f32>>(
    voxels: &[T],
    dims: [u32; 3],
    macrocells: [u32; 3],
) -> Vec<[f32; 2]> {
    let [width, height] = [dims[0] as usize, dims[1] as usize];
    let [columns, rows, slices] = macrocells.map(|n| n as usize);
    let mut all = vec![[0.0; 2]; columns * rows * slices];
    let row_by_row = all.par_chunks_mut(columns).enumerate();
    row_by_row.for_each(|(n, ranges)| {
        let inside = corners(n / rows, dims[2])
            .flat_map(|k| corners(n % rows, dims[1]).map(move |j| k * height + j));
        let inside = inside.map(|row| &voxels[row * width..][..width]);
        range_row(inside, ranges);
    });
    all
}

/// The voxels that the cells of macrocell m interpolate along an axis: m·B − 1 … m·B + B − 1.
fn corners(macrocell: usize, dim: u32) -> std::ops::Range<usize> {
    let size = MACROCELL as usize;
    let low = (macrocell * size).max(1) - 1;
    low..(macrocell * size + size).min(dim as usize)
}

/// The ranges of a row of macrocells. Its rows of voxels are folded into one first, which is most of the
/// work and what a processor does many at a time.
fn range_row<'a, T: Copy + PartialOrd + Into<f32> + 'a>(
    mut inside: impl Iterator<Item = &'a [T]>,
    ranges: &mut [[f32; 2]],
) {
    let mut low = inside.next().unwrap_or_default().to_vec();
    let mut high = low.clone();
    for row in inside {
        for ((low, high), &value) in low.iter_mut().zip(&mut high).zip(row) {
            *low = lesser(*low, value);
            *high = greater(*high, value);
        }
    }
    for (m, range) in ranges.iter_mut().enumerate() {
        let columns = corners(m, low.len() as u32);
        let first = columns.start;
        *range = [
            low[columns.clone()]
                .iter()
                .copied()
                .fold(low[first], lesser),
            high[columns].iter().copied().fold(high[first], greater),
        ]
        .map(Into::into);
    }
}

fn lesser<T: PartialOrd>(a: T, b: T) -> T {
    if b < a { b } else { a }
}

fn greater<T: PartialOrd>(a: T, b: T) -> T {
    if b > a { b } else { a }
}
