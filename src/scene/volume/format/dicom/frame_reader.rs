//! Reads the frames of a stack: their words as the files have them, and the numbers that these stand for.
//!
//! Plain pixels are read in place, row by row, by any number of threads. A packed frame can only be unpacked as a
//! whole, and so can one that is interpolated with others; the last few of these frames are kept, since a region
//! rarely ends where a frame does. If two threads need the same frame at once, one of them unpacks it and the other
//! waits.

use std::collections::VecDeque;
use std::sync::{Arc, Mutex, OnceLock};

use rayon::prelude::*;

use crate::locked::locked;
use crate::scene::volume::parsed::Parsed;
use crate::scene::volume::region::Region;
use crate::scene::volume::voxel_type::VoxelType;

use super::fragments::Fragments;
use super::group::{At, frame};
use super::image::Image;
use super::run_length::LARGEST_RATIO;
use super::stack::Stack;
use super::syntax::Packing;
use super::unpack::{Unpacked, unpack};
use super::values::{FrameConversion, Map, Values, joined};

/// Bytes of frames that are kept, unless two for each thread take more.
const MOST_KEPT: usize = 32 << 20;
/// Frames that are kept, however small they are: they are searched one by one.
const MOST_FRAMES: usize = 256;

/// The numbers of a whole frame, or the reason why they cannot be read.
type Numbers = Parsed<Arc<Vec<u8>>>;

#[derive(Debug)]
pub struct FrameReader {
    images: Vec<Image>,
    /// The fragments of each image, once they have been needed.
    fragments: Vec<OnceLock<Parsed<Fragments>>>,
    /// The stack's frames, in its order.
    frames: Vec<At>,
    /// The conversion of each of `frames`.
    maps: Vec<Map>,
    voxel_type: VoxelType,
    /// The number in place of values that were not measured.
    filler: f64,
    /// The last frames, by their index in the stack; the newest at the end.
    kept: Mutex<VecDeque<(usize, Arc<OnceLock<Numbers>>)>>,
}

impl FrameReader {
    pub fn new(images: Vec<Image>, stack: &mut Stack, values: &Values) -> Parsed<FrameReader> {
        let mut reader = FrameReader {
            fragments: images.iter().map(|_| OnceLock::new()).collect(),
            images,
            frames: std::mem::take(&mut stack.frames),
            maps: values.maps.clone(),
            voxel_type: values.voxel_type,
            filler: 0.0,
            kept: Mutex::default(),
        };
        reader.check_claims()?;
        let has_padding = reader.images.iter().any(|image| image.padding.is_some());
        if has_padding || stack.is_sheared() {
            reader.filler = reader.smallest()?;
        }
        Ok(reader)
    }

    /// Unpacks frames that claim more pixels than run-length packing could hold, so that no memory is allocated for
    /// their voxels before it is known that they are there.
    fn check_claims(&self) -> Parsed<()> {
        let is_unlikely = |at: &&At| {
            let image = &self.images[at.image];
            let all = image.frame_pixels() * u64::from(image.frame_count);
            all / LARGEST_RATIO > image.place.bytes()
        };
        let frames: Vec<&At> = self.frames.iter().filter(is_unlikely).collect();
        (frames.into_par_iter()).try_for_each(|at| self.words(*at).map(|_| ()))
    }

    /// The smallest number that stands for a measurement.
    fn smallest(&self) -> Parsed<f64> {
        let range = |n: usize| {
            let unpacked = self.words(self.frames[n])?;
            Ok::<_, String>(self.conversion(n, &unpacked).range(&unpacked.words))
        };
        let ranges = (0..self.frames.len()).into_par_iter().map(range);
        let join = |a: Option<[f64; 2]>, b: Option<[f64; 2]>| match (a, b) {
            (a, Some(b)) => Ok(Some(joined(a, b))),
            (a, None) => Ok(a),
        };
        let range = ranges.try_reduce(|| None, join)?;
        Ok(range.map_or(0.0, |[low, _]| low))
    }

    pub fn images(&self) -> &[Image] {
        &self.images
    }

    /// The image that holds a frame of the stack.
    pub fn image(&self, n: usize) -> &Image {
        &self.images[self.frames[n].image]
    }

    pub fn voxel_type(&self) -> VoxelType {
        self.voxel_type
    }

    pub fn filler(&self) -> f64 {
        self.filler
    }

    fn conversion(&self, n: usize, unpacked: &Unpacked) -> FrameConversion {
        let image = self.image(n);
        FrameConversion {
            padding: image.padding,
            filler: self.filler,
            ..FrameConversion::new(unpacked, self.maps[n], self.voxel_type)
        }
    }

    /// A frame's words as they are in the file.
    pub fn words(&self, at: At) -> Parsed<Unpacked> {
        let image = &self.images[at.image];
        let index = frame(&self.images, at).index;
        let read = match packing(image)? {
            Packing::Plain => plain(image, index, 0, image.rows),
            packing => {
                let fragments = self.fragments[at.image].get_or_init(|| Fragments::of(image));
                let fragments = fragments.as_ref().map_err(String::clone);
                fragments.and_then(|fragments| unpack(image, fragments, index, packing))
            }
        };
        read.map_err(|fault| image.named(&fault))
    }

    /// The numbers of a whole frame of the stack, which is kept for the next read.
    pub fn numbers(&self, n: usize) -> Numbers {
        let place = self.kept(n);
        let numbers = place.get_or_init(|| {
            let unpacked = self.words(self.frames[n])?;
            let count = self.image(n).frame_pixels() as usize;
            let mut numbers = vec![0; count * self.voxel_type.bytes()];
            self.conversion(n, &unpacked)
                .convert(&unpacked.words, &mut numbers);
            Ok(Arc::new(numbers))
        });
        numbers.clone()
    }

    /// The place where a frame's numbers are kept; a new one takes that of the oldest.
    fn kept(&self, n: usize) -> Arc<OnceLock<Numbers>> {
        let mut kept = locked(&self.kept);
        if let Some((_, place)) = kept.iter().find(|(other, _)| *other == n) {
            return place.clone();
        }
        let size = self.image(n).frame_pixels() as usize * self.voxel_type.bytes();
        let most = (MOST_KEPT / size)
            .min(MOST_FRAMES)
            .max(2 * rayon::current_num_threads());
        while kept.len() >= most {
            kept.pop_front();
        }
        let place = Arc::<OnceLock<Numbers>>::default();
        kept.push_back((n, place.clone()));
        place
    }

    /// Reads the part of a frame of the stack that lies in a region of one slice.
    pub fn read(&self, n: usize, region: Region, bytes: &mut [u8]) -> Parsed<()> {
        let image = self.image(n);
        let is_plain = packing(image)? == Packing::Plain && !image.place.is_deflated;
        let [column, row, _] = region.low;
        let [width, height, _] = region.dims.map(|size| size as usize);
        let size = self.voxel_type.bytes();
        if is_plain && width == image.columns as usize {
            let index = frame(&self.images, self.frames[n]).index;
            let words = plain(image, index, row, region.dims[1]);
            let words = words.map_err(|fault| image.named(&fault))?;
            self.conversion(n, &words).convert(&words.words, bytes);
            return Ok(());
        }
        let numbers = self.numbers(n)?;
        let parts = bytes.chunks_exact_mut(width * size).take(height);
        for (n, part) in parts.enumerate() {
            let first = (row as usize + n) * image.columns as usize + column as usize;
            part.copy_from_slice(&numbers[first * size..][..width * size]);
        }
        Ok(())
    }
}

fn packing(image: &Image) -> Parsed<Packing> {
    if let Some(damage) = &image.damage {
        return Err(image.named(damage));
    }
    let packing = image.transfer.packing;
    packing.map_err(|remedy| image.named(remedy))
}

/// Reads rows of a frame with plain pixels.
fn plain(image: &Image, index: u32, first: u32, rows: u32) -> Parsed<Unpacked> {
    let row = u64::from(image.columns) * image.samples.bytes();
    let mut words = vec![0; (u64::from(rows) * row) as usize];
    let before = u64::from(index) * image.frame_bytes() + u64::from(first) * row;
    image.place.read(image.pixels.at + before, &mut words)?;
    Ok(Unpacked {
        words,
        samples: image.samples,
        endian: image.transfer.syntax.endian,
    })
}
