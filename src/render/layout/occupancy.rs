//! Which macrocells matter to the cache: those where the medium scatters, and in `full` light those
//! where a surface shows. (In `local` light a cache has to outlive isovalues.) The plan has to know the
//! cache's size before anything is on the GPU, so this is worked out on the CPU, by the rule of
//! `majorants.comp`.

use std::ops::RangeInclusive;

use rayon::prelude::*;

use crate::render::packed::position;
use crate::render::parts::{Field, Medium, Parts, TransferPoint};
use crate::render::shared::{Clip, INTERPOLATION_ROUNDING, MACROCELL, Surface};
use crate::scene::volume::Volume;

pub struct Occupancy {
    /// Macrocells along each axis.
    pub macrocells: [u32; 3],
    /// Whether each macrocell is occupied, x fastest.
    pub occupied: Vec<bool>,
}

impl Occupancy {
    /// The macrocells in which the cache needs memory.
    pub fn new(parts: &Parts, volume: &Volume) -> Occupancy {
        let obstacles = parts.surfaces.obstacles().map_or(&[][..], |s| &s.iso);
        Occupancy::of(parts, obstacles, volume)
    }

    /// The macrocells in which anything is seen: the medium, or any surface.
    pub fn with_surfaces(parts: &Parts, volume: &Volume) -> Occupancy {
        Occupancy::of(parts, &parts.surfaces.iso, volume)
    }

    fn of(parts: &Parts, surfaces: &[Surface], volume: &Volume) -> Occupancy {
        let Parts {
            field,
            medium,
            clips,
            ..
        } = parts;
        let macrocells = field.macrocells();
        let shows = |range: [f32; 2], s: &Surface| range[0] < s.value && range[1] >= s.value;
        let matters = |(n, &range): (usize, &[f32; 2])| {
            (scatters(range, medium) || surfaces.iter().any(|s| shows(range, s)))
                && !is_clipped(position(n as u32, macrocells), field, clips)
        };
        let ranges = volume.macrocell_ranges().par_iter().enumerate();
        Occupancy {
            macrocells,
            occupied: ranges.map(matters).collect(),
        }
    }

    /// Whether a macrocell at a face of the box is occupied.
    pub fn meets_faces(&self) -> bool {
        let is_at_face = |n: usize| {
            let cell = position(n as u32, self.macrocells);
            (0..3).any(|a| cell[a] == 0 || cell[a] + 1 == self.macrocells[a])
        };
        let mut occupied = self.occupied.iter().enumerate();
        occupied.any(|(n, &is)| is && is_at_face(n))
    }

    /// The macrocells along axis `a` that meet [low, high] (grid space).
    pub fn span(&self, a: usize, [low, high]: [f32; 2]) -> RangeInclusive<usize> {
        let index = |g: f32| {
            let cell = (g / MACROCELL as f32).floor().max(0.0) as u32;
            cell.min(self.macrocells[a] - 1) as usize
        };
        index(low)..=index(high)
    }

    /// For each macrocell along x, whether any is occupied that has the same x and lies within two spans.
    pub fn row(&self, y: &RangeInclusive<usize>, z: &RangeInclusive<usize>) -> Vec<bool> {
        let [width, height, _] = self.macrocells.map(|n| n as usize);
        let mut row = vec![false; width];
        for k in z.clone() {
            for j in y.clone() {
                let first = (k * height + j) * width;
                let occupied = &self.occupied[first..first + width];
                row.iter_mut()
                    .zip(occupied)
                    .for_each(|(any, &is)| *any |= is);
            }
        }
        row
    }
}

/// The rule of `sigma_t_range` in `glsl/include/medium.glsl`: opacity is largest at an end of the range or at a point
/// of the transfer function within it.
fn scatters(range: [f32; 2], medium: &Medium) -> bool {
    let transfer = &medium.transfer;
    let rounding = if range[0] < range[1] {
        INTERPOLATION_ROUNDING * range[0].abs().max(range[1].abs())
    } else {
        0.0
    };
    let [low, high] = [range[0] - rounding, range[1] + rounding];
    let first = transfer.partition_point(|p| p.value <= low);
    let within = |p: &&TransferPoint| p.value <= high;
    !medium.is_vacuum()
        && (opacity(low, transfer) > 0.0
            || opacity(high, transfer) > 0.0
            || transfer[first..]
                .iter()
                .take_while(within)
                .any(|p| p.opacity > 0.0))
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
fn is_clipped(macrocell: [u32; 3], field: &Field, clips: &[Clip]) -> bool {
    clips.iter().any(|clip| {
        let nearest: f32 = (0..3)
            .map(|a| {
                let side = macrocell[a] + (clip.normal[a] < 0.0) as u32;
                let grid = (side * MACROCELL) as f32;
                clip.normal[a] * ((grid - 0.5) * field.spacing[a] - field.half_extent[a])
            })
            .sum();
        nearest > clip.offset
    })
}
