//! How a volume that does not fit is cut into bricks, how many of them the device holds at once, and in how many images.
//!
//! A brick has the first voxels behind it along each axis as well, so that every trilinear cell lies in one brick. With
//! 32 voxels a side that is a tenth more memory, and a ray leaves few voxels of a brick unread; larger ones would be
//! read from the file a little faster, and waste more of a small budget.

use crate::gpu::DeviceSummary;
use crate::render::packed::{self, pack, position};
use crate::render::shared::PLACES_DEEP;
use crate::render::volume_images::VOLUME_IMAGES;
use crate::scene::volume::BRICK_SIDE;

/// A volume in bricks, and images with places for some of them.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct BrickLayout {
    /// Voxels along a side, without those behind it: a power of two.
    pub side: u32,
    /// Bricks of the volume along each axis.
    pub bricks: [u32; 3],
    /// Images, all of one size.
    pub images: u32,
    /// Places for bricks in an image along each axis.
    pub places: [u32; 3],
    /// Bytes of bricks that the host keeps in its own memory.
    pub host_bytes: u64,
}

/// The place of a brick.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Place {
    /// Which image it is in.
    pub image: usize,
    /// Its position among the places of the image.
    pub position: [u32; 3],
}

impl BrickLayout {
    /// At least `places` places for bricks, unless the device's images or the volume have fewer. Voxels take `voxel_bytes`.
    pub fn new(
        dims: [u32; 3],
        voxel_bytes: usize,
        places: u64,
        limits: &DeviceSummary,
    ) -> BrickLayout {
        BrickLayout::with_side(BRICK_SIDE, dims, voxel_bytes, places, limits)
    }

    /// A layout as from [`new`](BrickLayout::new), with bricks of another size, which must be a power of two.
    pub fn with_side(
        side: u32,
        dims: [u32; 3],
        voxel_bytes: usize,
        places: u64,
        limits: &DeviceSummary,
    ) -> BrickLayout {
        let bricks = BrickLayout::count(dims, side);
        let (most_images, most) = most_places(side, voxel_bytes, limits);
        let places = places.clamp(1, product(bricks));
        let images = places.div_ceil(most).min(most_images);
        let places = places.div_ceil(images);
        let most_along = places_along(side, limits);
        let width = ((places as f64).cbrt().ceil() as u32).min(most_along);
        let height = (places.div_ceil(u64::from(width)) as f64).sqrt().ceil() as u32;
        let height = height.min(most_along);
        let depth = places.div_ceil(u64::from(width) * u64::from(height));
        BrickLayout {
            side,
            bricks,
            images: images as u32,
            places: [
                width,
                height,
                depth.min(u64::from(most_along.min(PLACES_DEEP))) as u32,
            ],
            host_bytes: 0,
        }
    }

    /// About the most places that the device's images and allocations have room for.
    pub fn most_places(&self, voxel_bytes: usize, limits: &DeviceSummary) -> u64 {
        let (images, of_each) = most_places(self.side, voxel_bytes, limits);
        images * of_each
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
        self.images * product(self.places) as u32
    }

    /// Texels of an image along each axis.
    pub fn extent(&self) -> [u32; 3] {
        self.places.map(|n| n * self.pitch())
    }

    /// Texels along a side of a place.
    pub fn pitch(&self) -> u32 {
        self.side + 1
    }

    pub fn place(&self, index: u32) -> Place {
        let of_image = product(self.places) as u32;
        Place {
            image: (index / of_image) as usize,
            position: position(index % of_image, self.places),
        }
    }

    /// The page of a brick at this place, without flags.
    pub fn page(&self, index: u32) -> u32 {
        let Place {
            image,
            position: [x, y, z],
        } = self.place(index);
        pack([x, y, image as u32 * PLACES_DEEP + z])
    }

    pub fn brick(&self, index: u32) -> [u32; 3] {
        position(index, self.bricks)
    }
}

/// The most images for bricks with `side` voxels along a side, and the most places in each of them.
fn most_places(side: u32, voxel_bytes: usize, limits: &DeviceSummary) -> (u64, u64) {
    let images = VOLUME_IMAGES.len() as u64;
    let images = images.min(1 + u64::from(limits.extra_images));
    // Drivers pad images.
    let allocation = limits.max_allocation_bytes / 16 * 15;
    let places = allocation / (u64::from(side + 1).pow(3) * voxel_bytes as u64);
    let along = places_along(side, limits);
    let most = product([along, along, along.min(PLACES_DEEP)]);
    (images, places.clamp(1, most))
}

/// The most places along an axis of an image.
fn places_along(side: u32, limits: &DeviceSummary) -> u32 {
    (limits.max_image_3d / (side + 1)).clamp(1, packed::MOST)
}

fn product(counts: [u32; 3]) -> u64 {
    counts.iter().map(|&n| u64::from(n)).product()
}

#[cfg(test)]
mod tests {
    use std::collections::HashSet;

    use super::*;
    use crate::gpu::DeviceKind;

    /// Allocations that hold five bricks of 9³ bytes.
    fn limits(extra_images: u32) -> DeviceSummary {
        DeviceSummary {
            index: 0,
            name: "a device".into(),
            kind: DeviceKind::Other,
            driver: String::new(),
            api: String::new(),
            device_local_bytes: 1 << 30,
            max_image_2d: 256,
            max_image_3d: 256,
            max_storage_buffer_bytes: 1 << 30,
            max_allocation_bytes: 5 * 729 * 16 / 15 + 16,
            extra_images,
            lacks: Vec::new(),
            needs: Vec::new(),
        }
    }

    fn layout(places: u64, extra_images: u32) -> BrickLayout {
        BrickLayout::with_side(8, [80, 80, 80], 1, places, &limits(extra_images))
    }

    #[test]
    fn bricks_get_as_many_images_as_their_allocations_need() {
        let images = |places, extra| layout(places, extra).images;
        assert_eq!([1, 5, 6, 11].map(|places| images(places, 15)), [1, 1, 2, 3]);
        // The device has no more images, and an allocation that is too large is refused when it is planned.
        assert_eq!([images(11, 0), images(11, 1), images(1000, 40)], [1, 2, 16]);
        assert_eq!(layout(1, 2).most_places(1, &limits(2)), 15);
    }

    #[test]
    fn every_place_has_a_page_of_its_own() {
        let layout = layout(70, 15);
        let pages: HashSet<u32> = (0..layout.capacity()).map(|n| layout.page(n)).collect();
        assert_eq!(pages.len(), layout.capacity() as usize);
        assert!(layout.capacity() >= 70 && layout.images == 14, "{layout:?}");
    }
}
