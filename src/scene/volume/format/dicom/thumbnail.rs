//! A picture of a volume's middle slice, for which no other slice is decoded.
//!
//! The slice is read as a volume of its own, so that values and packings are handled as in whole volumes.

use crate::scene::volume::parsed::Parsed;
use crate::scene::volume::region::Region;
use crate::scene::volume::source::Source;
use crate::scene::volume::thumbnail::Thumbnail;

use super::group::{At, Group, frame};
use super::image::Image;
use super::numbers::add;
use super::source::StackSource;
use super::stack::Stack;
use super::values::Values;

/// The most pixels of a slice: a picture of a larger one would take too long.
const MOST_PIXELS: u64 = 1 << 23;

/// `frames` are those of a volume, in its order.
pub fn thumbnail(images: &[Image], frames: &[At]) -> Parsed<Thumbnail> {
    let middle = frames[frames.len() / 2];
    let image = Image {
        frames: vec![frame(images, middle).clone()],
        ..images[middle.image].clone()
    };
    let pixels = image.frame_pixels();
    if pixels > MOST_PIXELS {
        return Err(image.named(&format!(
            "a slice has {pixels} pixels, expected at most {MOST_PIXELS} for a thumbnail"
        )));
    }
    let values = Values::of(&[(&image, &image.frames[0])])?;
    let only = Group {
        frames: vec![At { image: 0, frame: 0 }],
    };
    let images = vec![image];
    let stack = Stack::new(&images, &only)?;
    let ([columns, rows, _], [width, height, _]) = (stack.dims, stack.spacing);
    let region = Region::whole([columns, rows, 1]);
    let source = StackSource::new(images, stack, &values)?;
    let mut bytes = vec![0; region.voxels() * values.voxel_type.bytes()];
    source.cursor().read(region, &mut bytes)?;
    let mut numbers = vec![0.0; region.voxels()];
    add(&bytes, values.voxel_type, 1.0, &mut numbers);
    Ok(Thumbnail::of(&numbers, [columns, rows], [width, height]))
}
