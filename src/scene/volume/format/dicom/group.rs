//! Frames that belong together, of whichever files.

use super::frame::Frame;
use super::image::Image;

/// A frame among those of all images.
#[derive(Debug, Clone, Copy)]
pub struct At {
    pub image: usize,
    pub frame: usize,
}

/// The frames of one volume, in the order in which they were found.
#[derive(Debug, Clone)]
pub struct Group {
    pub frames: Vec<At>,
}

pub fn frame(images: &[Image], at: At) -> &Frame {
    &images[at.image].frames[at.frame]
}
