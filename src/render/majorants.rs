//! The largest extinction, cell by cell; once a transfer function.
//!
//! A step from cell to cell costs a path about as much as a tentative collision does, so cells are macrocells
//! in small volumes and several of them in large ones.

use std::sync::Arc;

use super::constants::TransferPoint;
use super::resources::Resources;
use super::shared::{Features, MACROCELL};
use crate::error::Result;
use crate::gpu::{Binding, Device, Frame, Pass, PassDesc, Shaders, Specialization};
use crate::scene::volume::Volume;

pub struct Majorants(Pass);

impl Majorants {
    pub fn new(device: &Arc<Device>, shaders: &Shaders, features: &Features) -> Result<Self> {
        let desc = PassDesc {
            name: "majorants",
            specialization: &features.words(),
            macros: &features.formats(),
        };
        Ok(Majorants(Pass::new(device, shaders, &desc)?))
    }

    /// `cells`: how many there are along each axis.
    pub fn run(&self, frame: &mut Frame, r: &Resources, cells: [u32; 3]) -> Result<()> {
        let bindings = [
            ("scene_block", Binding::Buffer(&r.scene)),
            ("transfer", Binding::Image(&r.transfer)),
            ("ranges", Binding::Image(&r.ranges)),
            ("majorants", Binding::Image(&r.majorants)),
        ];
        frame.run_in_slices(&self.0, &bindings, &(), cells)
    }
}

/// Of the transfer function's points.
pub fn largest_opacity(transfer: &[TransferPoint]) -> f32 {
    transfer
        .iter()
        .map(|point| point.opacity)
        .fold(0.0, f32::max)
}

/// The cells' sides in grid units, given the largest extinction anywhere. They grow as long as a ray meets
/// few collisions in one and there are enough of them to keep empty space apart.
pub fn cell_size(volume: &Volume, densest: f32) -> u32 {
    const MOST_COLLISIONS: f32 = 4.0;
    const LEAST_CELLS: u32 = 32;
    let longest = volume.dims.into_iter().max().unwrap_or(0);
    let voxel = volume.spacing.into_iter().fold(0.0, f64::max) as f32;
    let fits = |size: &u32| {
        densest * voxel * (*size as f32) <= MOST_COLLISIONS && longest / size >= LEAST_CELLS
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
        cell_size(&volume.expect("a volume"), densest)
    }

    #[test]
    fn cells_grow_with_the_volume() {
        let sizes = [64, 511, 512, 1024, 2048].map(|longest| size(longest, 0.0));
        assert_eq!(sizes, [8, 8, 16, 32, 64]);
    }

    #[test]
    fn cells_stay_small_where_a_path_is_short() {
        let sizes = [1.0, 0.25, 0.125, 0.0625].map(|densest| size(2048, densest));
        assert_eq!(sizes, [8, 16, 32, 64]);
    }
}
