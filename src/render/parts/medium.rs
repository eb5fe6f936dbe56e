//! The participating medium: its transfer function, and how finely its majorants are kept.

use super::{is_grey, stored};
use crate::render::features::Features;
use crate::render::shared::{MACROCELL, SceneConstants};
use crate::scene::volume::Volume;
use crate::scene::{self};

/// Rows of the transfer function's image.
pub const TRANSFER_ROWS: u32 = 3;

#[derive(Debug, Clone, PartialEq)]
pub struct Medium {
    /// σt where opacity is 1, per world unit.
    pub density: f32,
    /// Henyey–Greenstein asymmetry.
    pub g: f32,
    /// Non-decreasing in value; empty in vacuum.
    pub transfer: Vec<TransferPoint>,
    /// Opacity at stored value 0 and its slope, if one straight line holds for all voxels.
    pub linear_opacity: Option<[f32; 2]>,
    /// Sides of the blocks, in trilinear cells.
    pub block_size: u32,
}

/// A point of the transfer function.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct TransferPoint {
    /// Stored value.
    pub value: f32,
    pub opacity: f32,
    pub color: [f32; 3],
}

impl Medium {
    pub fn new(medium: Option<&scene::Medium>, volume: &Volume) -> Medium {
        let points = medium.iter().flat_map(|m| &m.transfer);
        let transfer: Vec<TransferPoint> = points
            .map(|p| TransferPoint {
                value: stored(volume, p.value),
                opacity: p.opacity as f32,
                color: p.color.map(|c| c as f32),
            })
            .collect();
        let density = medium.map_or(0.0, |m| m.density as f32);
        Medium {
            density,
            g: medium.map_or(0.0, |m| m.g as f32),
            linear_opacity: linear_opacity(&transfer, volume),
            block_size: block_size(volume, density * largest_opacity(&transfer)),
            transfer,
        }
    }

    /// Sets the features that shaders are compiled with because of the medium.
    pub fn require(&self, features: &mut Features) {
        features.has_medium = !self.is_vacuum();
        features.has_one_color = self.has_one_color();
        features.is_linear = self.has_one_color() && self.linear_opacity.is_some();
        features.is_anisotropic = self.is_anisotropic();
    }

    /// Writes the constants of the medium, apart from the transfer function's image.
    pub fn write(&self, constants: &mut SceneConstants) {
        constants.block_size = self.block_size as f32;
        constants.density = self.density;
        constants.g = self.g;
        constants.transfer_segments = self.segments();
        constants.color = self.transfer.first().map_or([0.0; 3], |p| p.color);
        constants.linear_opacity = self.linear_opacity.unwrap_or_default();
    }

    pub fn is_vacuum(&self) -> bool {
        self.density <= 0.0
    }

    pub fn is_anisotropic(&self) -> bool {
        !self.is_vacuum() && self.g != 0.0
    }

    /// All points of the transfer function have the same colour.
    pub fn has_one_color(&self) -> bool {
        self.transfer.windows(2).all(|w| w[0].color == w[1].color)
    }

    /// Whether it scatters all channels of the light alike.
    pub fn is_grey(&self) -> bool {
        self.transfer.iter().all(|point| is_grey(point.color))
    }

    /// The largest extinction that the transfer function allows, per world unit.
    pub fn largest_extinction(&self) -> f32 {
        self.density * largest_opacity(&self.transfer)
    }

    /// Columns of the transfer function from which values are interpolated: from each point to the next, and
    /// one more if the last is a step, which begins where it ends.
    pub fn segments(&self) -> u32 {
        let points = &self.transfer;
        let steps_at_end = matches!(points[..], [.., a, b] if a.value == b.value);
        let segments = points.len().max(2) - 1;
        (segments + usize::from(steps_at_end)) as u32
    }

    /// The texels of the transfer function's image, in [`TRANSFER_ROWS`] rows. The first row has a column for each
    /// point, of which the last stands twice: value, 1 / (distance to the next value), opacity and the next point's
    /// opacity. The second row has the colours and, in its last component, the integral of opacity over values from
    /// the first point to this one; the third row has the integral of opacity times colour.
    pub fn transfer_texels(&self) -> Vec<[f32; 4]> {
        let points = || self.transfer.iter().chain(self.transfer.last());
        let next = points().skip(1).chain(self.transfer.last());
        let shares = points().zip(next).map(|(point, next)| {
            let distance = next.value - point.value;
            let per_value = if distance > 0.0 { 1.0 / distance } else { 0.0 };
            [point.value, per_value, point.opacity, next.opacity]
        });
        let integrals = self.opacity_integrals();
        let colors = points().zip(&integrals).map(|(point, integral)| {
            let [r, g, b] = point.color;
            [r, g, b, integral[3] as f32]
        });
        let colored = integrals
            .iter()
            .map(|i| [i[0] as f32, i[1] as f32, i[2] as f32, 0.0]);
        shares.chain(colors).chain(colored).collect()
    }

    /// ∫ opacity · colour and, last, ∫ opacity over values from the first point to each point, of which the last stands
    /// twice.
    fn opacity_integrals(&self) -> Vec<[f64; 4]> {
        let mut sum = [0.0; 4];
        let mut integrals: Vec<[f64; 4]> = self.transfer.first().map(|_| sum).into_iter().collect();
        for pair in self.transfer.windows(2) {
            let distance = f64::from(pair[1].value) - f64::from(pair[0].value);
            let [a, b] = [0, 1].map(|i| f64::from(pair[i].opacity));
            let colored = |c: usize| {
                let [x, y] = [0, 1].map(|i| f64::from(pair[i].color[c]));
                (a * (2.0 * x + y) + b * (x + 2.0 * y)) / 6.0
            };
            let means = [colored(0), colored(1), colored(2), (a + b) / 2.0];
            sum = std::array::from_fn(|i| sum[i] + distance * means[i]);
            integrals.push(sum);
        }
        integrals.extend(integrals.last().copied());
        integrals
    }
}

fn linear_opacity(transfer: &[TransferPoint], volume: &Volume) -> Option<[f32; 2]> {
    let [low, high] = volume.range.map(|value| stored(volume, value));
    let line = |n: usize| {
        let [a, b] = [&transfer[n], &transfer[n + 1]];
        // At a step the upper point counts.
        let ends_in_a_step = transfer.get(n + 2).is_some_and(|c| c.value == b.value);
        let holds = a.value <= low && high <= b.value && a.value < b.value && !ends_in_a_step;
        let slope = f64::from(b.opacity - a.opacity) / f64::from(b.value - a.value);
        let at_zero = f64::from(a.opacity) - slope * f64::from(a.value);
        holds.then_some([at_zero as f32, slope as f32])
    };
    (0..transfer.len().saturating_sub(1)).find_map(line)
}

fn largest_opacity(transfer: &[TransferPoint]) -> f32 {
    let opacities = transfer.iter().map(|point| point.opacity);
    opacities.fold(0.0, f32::max)
}

/// Sides of the blocks in trilinear cells. A step from block to block costs a path about as much as a tentative
/// collision does. So blocks are single macrocells in small volumes, and grow as long as a ray meets few collisions
/// in one (`densest` is the largest extinction anywhere) and there are enough of them to keep empty space apart.
fn block_size(volume: &Volume, densest: f32) -> u32 {
    const MOST_COLLISIONS: f32 = 4.0;
    const LEAST_BLOCKS: u32 = 32;
    let longest = volume.dims.into_iter().max().unwrap_or(0);
    let voxel = volume.spacing.into_iter().fold(0.0, f64::max) as f32;
    let fits = |size: &u32| {
        densest * voxel * (*size as f32) <= MOST_COLLISIONS && longest / size >= LEAST_BLOCKS
    };
    let doubled = std::iter::successors(Some(2 * MACROCELL), |size| Some(2 * size));
    doubled.take_while(fits).last().unwrap_or(MACROCELL)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene::volume::Voxels;

    fn size(longest: u32, densest: f32) -> u32 {
        let voxels = Voxels::U8(vec![0; longest as usize]);
        let volume = Volume::from_values([1, longest, 1], [0.5, 1.0, 0.5], voxels);
        block_size(&volume.expect("a volume"), densest)
    }

    #[test]
    fn blocks_grow_with_the_volume() {
        let sizes = [64, 511, 512, 1024, 2048].map(|longest| size(longest, 0.0));
        assert_eq!(sizes, [8, 8, 16, 32, 64]);
    }

    #[test]
    fn blocks_stay_small_where_a_path_is_short() {
        let sizes = [1.0, 0.25, 0.125, 0.0625].map(|densest| size(2048, densest));
        assert_eq!(sizes, [8, 16, 32, 64]);
    }
}
