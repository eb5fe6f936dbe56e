//! The GPU memory that only the published baseline takes.

use std::sync::Arc;

use crate::error::Result;
use crate::gpu::{Format, Image, ImageDesc, Memory};

/// The published baseline's cells, one a voxel: 14 floats each.
pub struct PublishedCells {
    /// Mean over paths and, in alpha, their number.
    pub radiance: Image,
    /// Position of the path under way and, in alpha, its number of bounces.
    pub position: Image,
    /// Direction of the path under way and, in alpha, the red of its throughput.
    pub direction: Image,
    /// Green and blue of the throughput of the path under way.
    pub throughput: Image,
}

impl PublishedCells {
    pub(in crate::render) fn allocate(
        memory: &Arc<Memory>,
        dims: [u32; 3],
    ) -> Result<PublishedCells> {
        let cells = |name, format| {
            let desc = ImageDesc::volumetric(name, dims, format).written().zeroed();
            Image::new(memory, desc)
        };
        Ok(PublishedCells {
            radiance: cells("published: radiance", Format::R32G32B32A32_SFLOAT)?,
            position: cells("published: position", Format::R32G32B32A32_SFLOAT)?,
            direction: cells("published: direction", Format::R32G32B32A32_SFLOAT)?,
            throughput: cells("published: throughput", Format::R32G32_SFLOAT)?,
        })
    }

    pub fn images(&self) -> [&Image; 4] {
        [
            &self.radiance,
            &self.position,
            &self.direction,
            &self.throughput,
        ]
    }

    /// Cells along each axis: one a voxel.
    pub fn dims(&self) -> [u32; 3] {
        self.radiance.desc().extent
    }

    /// Cells in all.
    pub fn count(&self) -> u64 {
        self.radiance
            .desc()
            .extent
            .iter()
            .map(|&n| n as u64)
            .product()
    }

    pub fn bytes(&self) -> u64 {
        self.images().iter().map(|i| i.desc().bytes()).sum()
    }
}
