//! How a volume that does not fit is cut into bricks, and how many of them the device holds at once.
//!
//! A brick has the first voxels behind it along each axis as well, so that every trilinear cell lies in one brick. With
//! 32 voxels a side that is a tenth more memory, and a ray leaves few voxels of a brick unread; larger ones would be
//! read from the file a little faster, and waste more of a small budget.

use crate::gpu::DeviceSummary;
use crate::render::packed::{self, position};

/// A volume in bricks, and an image with places for some of them.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct BrickLayout {
    /// Voxels along a side, without those behind it: a power of two.
    pub side: u32,
    /// Bricks of the volume along each axis.
    pub bricks: [u32; 3],
    /// Places for them in the image along each axis.
    pub places: [u32; 3],
    /// Bytes of bricks that the host keeps in its own memory.
    pub host_bytes: u64,
}

impl BrickLayout {
    /// Voxels along a side by default.
    pub const SIDE: u32 = 32;

    /// At least `places` places for bricks, unless the device's images or the volume have fewer.
    pub fn new(dims: [u32; 3], places: u64, limits: &DeviceSummary) -> BrickLayout {
        BrickLayout::with_side(BrickLayout::SIDE, dims, places, limits)
    }

    /// A layout as from [`new`](BrickLayout::new), with bricks of another size, which must be a power of two.
    pub fn with_side(
        side: u32,
        dims: [u32; 3],
        places: u64,
        limits: &DeviceSummary,
    ) -> BrickLayout {
        let bricks = BrickLayout::count(dims, side);
        let most = (limits.max_image_3d / (side + 1)).clamp(1, packed::MOST);
        let places = places.clamp(1, product(bricks));
        let width = ((places as f64).cbrt().ceil() as u32).min(most);
        let height = (places.div_ceil(u64::from(width)) as f64).sqrt().ceil() as u32;
        let height = height.min(most);
        let depth = places.div_ceil(u64::from(width) * u64::from(height));
        BrickLayout {
            side,
            bricks,
            places: [width, height, depth.min(u64::from(most)) as u32],
            host_bytes: 0,
        }
    }

    /// This layout with `host_bytes` of bricks in the host's memory.
    pub fn with_host_bytes(self, host_bytes: u64) -> BrickLayout {
        BrickLayout { host_bytes, ..self }
    }

    /// Bricks of a volume along each axis.
    pub fn count(dims: [u32; 3], side: u32) -> [u32; 3] {
        dims.map(|n| n.div_ceil(side))
    }

    /// Bytes of a brick, with the voxels behind it.
    pub fn brick_bytes(&self, voxel_bytes: usize) -> u64 {
        u64::from(self.pitch()).pow(3) * voxel_bytes as u64
    }

    /// Number of bricks in the volume.
    pub fn total(&self) -> u32 {
        product(self.bricks) as u32
    }

    /// Bricks that the device holds at once.
    pub fn capacity(&self) -> u32 {
        product(self.places) as u32
    }

    /// Texels of the image along each axis.
    pub fn extent(&self) -> [u32; 3] {
        self.places.map(|n| n * self.pitch())
    }

    /// Texels along a side of a place.
    pub fn pitch(&self) -> u32 {
        self.side + 1
    }

    pub fn place(&self, index: u32) -> [u32; 3] {
        position(index, self.places)
    }

    pub fn brick(&self, index: u32) -> [u32; 3] {
        position(index, self.bricks)
    }
}

fn product(counts: [u32; 3]) -> u64 {
    counts.iter().map(|&n| u64::from(n)).product()
}
