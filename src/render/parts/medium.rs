//! The participating medium: its transfer function, and how finely its majorants are kept.

use super::{is_grey, stored};
use crate::render::features::Features;
use crate::render::shared::MACROCELL;
use crate::scene::volume::Volume;
use crate::scene::{self};

#[derive(Debug, Clone, PartialEq)]
pub struct Medium {
    /// σt where opacity is 1, per world unit.
    pub density: f32,
    /// Henyey–Greenstein asymmetry in (−1, 1), g > 0 forward.
    pub g: f32,
    /// Non-decreasing in value, and not beyond the volume's values; empty in vacuum.
    pub transfer: Vec<TransferPoint>,
    /// If all values of the volume lie on one segment of the transfer function: the stored value and the opacity at the end
    /// of that segment with the lower opacity, and the slope of opacity per stored value; `None` otherwise.
    pub linear_opacity: Option<[f32; 3]>,
    /// Sides of the blocks, in trilinear cells.
    pub block_size: u32,
}

/// A point of the transfer function.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct TransferPoint {
    /// Stored value.
    pub value: f32,
    /// In [0, 1]; extinction is density·opacity.
    pub opacity: f32,
    /// Single-scattering albedo of each channel, in [0, 1].
    pub color: [f32; 3],
}

impl Medium {
    pub fn new(medium: Option<&scene::Medium>, volume: &Volume) -> Medium {
        let points = medium.iter().flat_map(|m| &m.transfer);
        let points: Vec<TransferPoint> = points
            .map(|p| TransferPoint {
                value: stored(volume, p.value) as f32,
                opacity: p.opacity as f32,
                color: p.color.map(|c| c as f32),
            })
            .collect();
        let range = volume.range.map(|value| stored(volume, value) as f32);
        let transfer = over_values(&points, range);
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

    pub fn is_vacuum(&self) -> bool {
        self.density <= 0.0
    }

    /// Whether any value of the volume's may scatter light.
    pub fn scatters(&self) -> bool {
        let has_color = |point: &TransferPoint| point.color.iter().any(|&c| c > 0.0);
        self.largest_extinction() > 0.0 && self.transfer.iter().any(has_color)
    }

    pub fn is_anisotropic(&self) -> bool {
        !self.is_vacuum() && self.g != 0.0
    }

    /// All points of the transfer function have the same colour.
    pub fn has_one_color(&self) -> bool {
        self.transfer.windows(2).all(|w| w[0].color == w[1].color)
    }

    /// Colour of the transfer function's first point: of all of them if it has one colour.
    pub fn first_color(&self) -> [f32; 3] {
        self.transfer.first().map_or([0.0; 3], |point| point.color)
    }

    /// Whether it scatters all channels of the light alike.
    pub fn is_grey(&self) -> bool {
        self.transfer.iter().all(|point| is_grey(point.color))
    }

    /// Whether opacity rises and falls again as values grow, so that the medium may be a film between two materials.
    pub fn has_tents(&self) -> bool {
        let opacities = self.transfer.iter().map(|point| point.opacity);
        let mut slopes = opacities.clone().zip(opacities.skip(1));
        let rises = slopes.any(|(a, b)| a < b);
        rises && slopes.any(|(a, b)| a > b)
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
}

/// The transfer function over these values alone: what lies beyond is cut off, at the ends of the range. It would take digits
/// from the integrals over values, and bins from the search for points (`transfer_table.rs`), and count as a colour or an
/// extinction that the medium has nowhere.
fn over_values(points: &[TransferPoint], [low, high]: [f32; 2]) -> Vec<TransferPoint> {
    let below = points.partition_point(|point| point.value < low);
    let up_to_high = points.partition_point(|point| point.value <= high);
    // An end is cut where points lie beyond it and none on it.
    let cut = |value: f32, next: usize| {
        let is_on_it = next > 0 && points[next - 1].value == value
            || points.get(next).is_some_and(|point| point.value == value);
        (!is_on_it).then(|| point_between(points, next, value))
    };
    let first = (below > 0).then(|| cut(low, below)).flatten();
    let last = (up_to_high < points.len())
        .then(|| cut(high, up_to_high))
        .flatten();
    let within = points[below..up_to_high.max(below)].iter().copied();
    let last = last.filter(|_| first.is_none() || low < high);
    first.into_iter().chain(within).chain(last).collect()
}

/// The transfer function at `value`, which lies before the point number `next` and behind the one before it.
fn point_between(points: &[TransferPoint], next: usize, value: f32) -> TransferPoint {
    let (Some(a), Some(b)) = (points.get(next.wrapping_sub(1)), points.get(next)) else {
        let end = if next == 0 {
            points.first()
        } else {
            points.last()
        };
        return TransferPoint {
            value,
            ..*end.expect("a point beyond the value")
        };
    };
    let [low, high, at] = [a.value, b.value, value].map(f64::from);
    let share = (at - low) / (high - low);
    let mix = |x: f32, y: f32| (f64::from(x) + share * (f64::from(y) - f64::from(x))) as f32;
    TransferPoint {
        value,
        opacity: mix(a.opacity, b.opacity),
        color: std::array::from_fn(|c| mix(a.color[c], b.color[c])),
    }
}

/// A value, the opacity there, and the slope of the line on which all values in the volume lie; `None` if they do not. The
/// value is that of the lower end, so that opacity is exactly 0 where a ramp begins.
fn linear_opacity(transfer: &[TransferPoint], volume: &Volume) -> Option<[f32; 3]> {
    let [low, high] = volume.range.map(|value| stored(volume, value) as f32);
    let line = |n: usize| {
        let [a, b] = [&transfer[n], &transfer[n + 1]];
        // At a step the upper point counts.
        let ends_in_a_step = transfer.get(n + 2).is_some_and(|c| c.value == b.value);
        let holds = a.value <= low && high <= b.value && a.value < b.value && !ends_in_a_step;
        let slope = f64::from(b.opacity - a.opacity) / f64::from(b.value - a.value);
        let lower = if a.opacity <= b.opacity { a } else { b };
        holds.then_some([lower.value, lower.opacity, slope as f32])
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

    /// Value and opacity of each point that is left.
    fn cut(points: &[(f32, f32)], range: [f32; 2]) -> Vec<(f32, f32)> {
        let point = |&(value, opacity)| TransferPoint {
            value,
            opacity,
            color: [opacity; 3],
        };
        let points: Vec<_> = points.iter().map(point).collect();
        let left = over_values(&points, range);
        assert!(left.iter().all(|point| point.color == [point.opacity; 3]));
        left.iter()
            .map(|point| (point.value, point.opacity))
            .collect()
    }

    #[test]
    fn what_the_volume_does_not_hold_is_cut_off_the_transfer_function() {
        let within = [(1.0, 0.25), (2.0, 0.5), (2.0, 0.625), (3.0, 0.875)];
        assert_eq!(cut(&within, [1.0, 3.0]), within);
        assert_eq!(cut(&within, [0.0, 4.0]), within);
        // Far away, and half way between points.
        assert_eq!(
            cut(&[(-1e30, 0.5), (1e30, 0.5)], [0.0, 1.0]),
            [(0.0, 0.5), (1.0, 0.5)]
        );
        assert_eq!(
            cut(&within, [1.5, 2.5]),
            [(1.5, 0.375), (2.0, 0.5), (2.0, 0.625), (2.5, 0.75)]
        );
        // Steps at the ends stay; all values before the first point, behind the last one, and a single one.
        assert_eq!(cut(&within, [2.0, 2.5])[..2], [(2.0, 0.5), (2.0, 0.625)]);
        assert_eq!(cut(&within, [1.0, 2.0])[1..], [(2.0, 0.5), (2.0, 0.625)]);
        assert_eq!(cut(&within, [0.0, 0.5]), [(0.5, 0.25)]);
        assert_eq!(cut(&within, [7.0, 9.0]), [(7.0, 0.875)]);
        assert_eq!(cut(&within, [1.5, 1.5]), [(1.5, 0.375)]);
        assert_eq!(cut(&[], [0.0, 1.0]), []);
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
