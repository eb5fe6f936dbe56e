//! The source of a stack's voxels: decodes the slices that a region touches, and no others.

use std::path::PathBuf;

use crate::scene::volume::parsed::Parsed;
use crate::scene::volume::region::Region;
use crate::scene::volume::source::{Access, Cursor, Source};

use super::duplicates::compare;
use super::frame_reader::FrameReader;
use super::image::Image;
use super::interpolation::interpolate;
use super::slices::Slice;
use super::stack::Stack;
use super::values::Values;

#[derive(Debug)]
pub struct StackSource {
    reader: FrameReader,
    stack: Stack,
    is_sheared: bool,
}

impl StackSource {
    pub fn new(images: Vec<Image>, mut stack: Stack, values: &Values) -> Parsed<StackSource> {
        let reader = FrameReader::new(images, &mut stack, values)?;
        Ok(StackSource {
            reader,
            is_sheared: stack.is_sheared(),
            stack,
        })
    }

    /// Fails unless frames at one place are the same. `remedy` is the end of the sentence.
    pub fn compare_duplicates(&self, remedy: &str) -> Parsed<()> {
        compare(&self.reader, &self.stack.duplicates, remedy)
    }

    /// Reads the part of one slice that lies in a region.
    fn read_slice(&self, slice: Slice, region: Region, bytes: &mut [u8]) -> Parsed<()> {
        if slice.share != 0.0 || self.is_sheared {
            interpolate(&self.reader, &self.stack.shifts, slice, region, bytes)
        } else {
            self.reader.read(slice.below, region, bytes)
        }
    }
}

impl Source for StackSource {
    fn access(&self) -> Access {
        Access::Decoded
    }

    fn files(&self) -> Vec<PathBuf> {
        let images = self.reader.images().iter();
        images.map(|image| image.place.path.clone()).collect()
    }

    fn cursor(&self) -> Box<dyn Cursor + '_> {
        Box::new(self)
    }
}

impl Cursor for &StackSource {
    fn read(&mut self, region: Region, bytes: &mut [u8]) -> Parsed<()> {
        let [x, y, z] = region.dims.map(|size| size as usize);
        let slice_bytes = x * y * self.reader.voxel_type().bytes();
        let slices = &self.stack.slices[region.low[2] as usize..][..z];
        for (slice, part) in slices.iter().zip(bytes.chunks_exact_mut(slice_bytes)) {
            self.read_slice(*slice, region, part)?;
        }
        Ok(())
    }
}
