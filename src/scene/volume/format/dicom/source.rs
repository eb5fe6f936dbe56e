//! Reads a stack's voxels: decodes the slices that a region touches, and no others.
//!
//! Plain pixels are read in place, row by row, by any number of threads. A packed frame can only be unpacked as a
//! whole, and so can one that is interpolated with others; the last few of these frames are kept, since a region
//! rarely ends where a frame does. If two threads need the same frame at once, one of them unpacks it and the other
//! waits.

use std::collections::VecDeque;
use std::path::PathBuf;
use std::sync::{Arc, Mutex, OnceLock};

use rayon::prelude::*;

use crate::locked::locked;
use crate::scene::volume::parsed::Parsed;
use crate::scene::volume::region::Region;
use crate::scene::volume::source::{Cursor, Source};
use crate::scene::volume::voxel_type::VoxelType;

use super::fragments::Fragments;
use super::group::{At, frame};
use super::image::Image;
use super::run_length::LARGEST_RATIO;
use super::slices::Slice;
use super::stack::Stack;
use super::syntax::Packing;
use super::unpack::{Unpacked, unpack};
use super::values::{Conversion, Map, Values, joined};

/// Bytes of frames that are kept.
const MOST_KEPT: usize = 32 << 20;

type Numbers = Arc<OnceLock<Parsed<Vec<u8>>>>;

#[derive(Debug)]
pub struct Slices {
    images: Vec<Image>,
    /// The fragments of each image, once they have been needed.
    fragments: Vec<OnceLock<Parsed<Fragments>>>,
    stack: Stack,
    maps: Vec<Map>,
    voxel_type: VoxelType,
    /// The number in place of values that were not measured.
    filler: f64,
    /// The last frames, by their index in the stack; the newest at the end.
    kept: Mutex<VecDeque<(usize, Numbers)>>,
}

impl Slices {
    pub fn new(images: Vec<Image>, stack: Stack, values: &Values) -> Parsed<Slices> {
        let mut slices = Slices {
            fragments: images.iter().map(|_| OnceLock::new()).collect(),
            images,
            maps: values.maps.clone(),
            voxel_type: values.voxel_type,
            stack,
            filler: 0.0,
            kept: Mutex::default(),
        };
        slices.try_unlikely()?;
        let has_padding = slices.images.iter().any(|image| image.padding.is_some());
        if has_padding || slices.stack.is_sheared() {
            slices.filler = slices.smallest()?;
        }
        Ok(slices)
    }

    /// Unpacks frames that claim more pixels than run-length packing could hold, so that no memory is allocated for
    /// their voxels before it is known that they are there.
    fn try_unlikely(&self) -> Parsed<()> {
        let is_unlikely = |at: &&At| {
            let image = &self.images[at.image];
            let all = image.frame_pixels() * u64::from(image.frame_count);
            all / LARGEST_RATIO > image.place.length
        };
        let frames: Vec<&At> = self.stack.frames.iter().filter(is_unlikely).collect();
        frames.into_par_iter().try_for_each(|at| {
            let index = frame(&self.images, *at).index;
            self.words(at.image, index).map(|_| ())
        })
    }

    /// Fails unless frames at one place are the same. `remedy` is the end of the sentence.
    pub fn compare_doubles(&self, remedy: &str) -> Parsed<()> {
        let name = |at: At| self.images[at.image].frame_name(frame(&self.images, at).index);
        let compare = |(one, other): &(_, _)| {
            if self.holds_same([*one, *other])? {
                Ok(())
            } else {
                Err(format!(
                    "{} and {} lie at one place and hold different pixels, expected one slice for each place{remedy}",
                    name(*one),
                    name(*other)
                ))
            }
        };
        self.stack.doubles.par_iter().try_for_each(compare)
    }

    /// Whether two frames have the same values, however they are stored.
    fn holds_same(&self, pair: [At; 2]) -> Parsed<bool> {
        let described = pair.map(|at| (&self.images[at.image], frame(&self.images, at)));
        let values = Values::of(&described)?;
        let numbers = |n: usize| {
            let (image, frame) = described[n];
            let unpacked = self.words(pair[n].image, frame.index)?;
            let mut numbers = vec![0; image.frame_pixels() as usize * values.voxel_type.bytes()];
            let conversion = Conversion {
                samples: unpacked.samples,
                endian: unpacked.endian,
                is_inverted: image.is_inverted,
                padding: None,
                filler: 0.0,
                map: values.maps[n],
                to: values.voxel_type,
            };
            conversion.convert(&unpacked.words, &mut numbers);
            Ok::<_, String>(numbers)
        };
        Ok(numbers(0)? == numbers(1)?)
    }

    /// The smallest number that stands for a measurement.
    fn smallest(&self) -> Parsed<f64> {
        let range = |n: usize| {
            let (at, index) = self.place(n);
            let unpacked = self.words(at, index)?;
            Ok::<_, String>(self.conversion(n, &unpacked).range(&unpacked.words))
        };
        let ranges = (0..self.stack.frames.len()).into_par_iter().map(range);
        let join = |a: Option<[f64; 2]>, b: Option<[f64; 2]>| match (a, b) {
            (a, Some(b)) => Ok(Some(joined(a, b))),
            (a, None) => Ok(a),
        };
        let range = ranges.try_reduce(|| None, join)?;
        Ok(range.map_or(0.0, |[low, _]| low))
    }

    /// The image of a frame of the stack, and its index there.
    fn place(&self, n: usize) -> (usize, u32) {
        let at = self.stack.frames[n];
        (at.image, frame(&self.images, at).index)
    }

    fn conversion(&self, n: usize, unpacked: &Unpacked) -> Conversion {
        let image = &self.images[self.place(n).0];
        Conversion {
            samples: unpacked.samples,
            endian: unpacked.endian,
            is_inverted: image.is_inverted,
            padding: image.padding,
            filler: self.filler,
            map: self.maps[n],
            to: self.voxel_type,
        }
    }

    /// A frame's words as they are in the file.
    fn words(&self, image: usize, index: u32) -> Parsed<Unpacked> {
        let at = image;
        let image = &self.images[at];
        let read = match self.packing(image)? {
            Packing::Plain => self.plain(image, index, 0, image.rows),
            packing => {
                let fragments = self.fragments[at].get_or_init(|| Fragments::of(image));
                let fragments = fragments.as_ref().map_err(String::clone);
                fragments.and_then(|fragments| unpack(image, fragments, index, packing))
            }
        };
        read.map_err(|fault| image.named(&fault))
    }

    fn packing(&self, image: &Image) -> Parsed<Packing> {
        if let Some(damage) = &image.damage {
            return Err(image.named(damage));
        }
        let packing = image.transfer.packing;
        packing.map_err(|remedy| image.named(remedy))
    }

    /// Reads rows of a frame with plain pixels.
    fn plain(&self, image: &Image, index: u32, first: u32, rows: u32) -> Parsed<Unpacked> {
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

    /// The numbers of a whole frame, which is kept for the next read.
    fn numbers(&self, n: usize) -> Numbers {
        let numbers = {
            let mut kept = locked(&self.kept);
            match kept.iter().find(|(other, _)| *other == n) {
                Some((_, numbers)) => numbers.clone(),
                None => {
                    let image = &self.images[self.place(n).0];
                    let size = image.frame_pixels() as usize * self.voxel_type.bytes();
                    let most = (MOST_KEPT / size).max(2 * rayon::current_num_threads());
                    while kept.len() >= most {
                        kept.pop_front();
                    }
                    let numbers = Numbers::default();
                    kept.push_back((n, numbers.clone()));
                    numbers
                }
            }
        };
        numbers.get_or_init(|| {
            let (image, index) = self.place(n);
            let unpacked = self.words(image, index)?;
            let count = self.images[image].frame_pixels() as usize;
            let mut numbers = vec![0; count * self.voxel_type.bytes()];
            self.conversion(n, &unpacked)
                .convert(&unpacked.words, &mut numbers);
            Ok(numbers)
        });
        numbers
    }

    /// Reads the part of one slice that lies in a region.
    fn read_slice(&self, slice: Slice, region: Region, bytes: &mut [u8]) -> Parsed<()> {
        if slice.share != 0.0 || self.stack.is_sheared() {
            return self.interpolate(slice, region, bytes);
        }
        let (at, index) = self.place(slice.below);
        let image = &self.images[at];
        let is_plain = self.packing(image)? == Packing::Plain && !image.place.is_deflated;
        let [column, row, _] = region.low;
        let [width, height, _] = region.dims.map(|size| size as usize);
        let size = self.voxel_type.bytes();
        if is_plain && width == image.columns as usize {
            let words = self.plain(image, index, row, region.dims[1]);
            let words = words.map_err(|fault| image.named(&fault))?;
            self.conversion(slice.below, &words)
                .convert(&words.words, bytes);
            return Ok(());
        }
        let numbers = self.numbers(slice.below);
        let numbers = numbers.wait().as_ref().map_err(String::clone)?;
        for (n, part) in bytes
            .chunks_exact_mut(width * size)
            .enumerate()
            .take(height)
        {
            let first = (row as usize + n) * image.columns as usize + column as usize;
            part.copy_from_slice(&numbers[first * size..][..width * size]);
        }
        Ok(())
    }

    /// Interpolates between rows where the gantry was tilted, and between two frames where none lies at a slice's
    /// place.
    fn interpolate(&self, slice: Slice, region: Region, bytes: &mut [u8]) -> Parsed<()> {
        let [width, height, _] = region.dims.map(|size| size as usize);
        let mut row: Vec<f64> = vec![0.0; width];
        let size = self.voxel_type.bytes();
        for n in 0..height {
            row.fill(0.0);
            let y = f64::from(region.low[1]) + n as f64;
            let [below, above] = [1.0 - slice.share, slice.share];
            for (frame, weight) in [(slice.below, below), (slice.above, above)] {
                if weight > 0.0 {
                    self.add_row(
                        frame,
                        y - self.stack.shifts[frame],
                        weight,
                        region,
                        &mut row,
                    )?;
                }
            }
            let part = &mut bytes[n * width * size..][..width * size];
            write(&row, self.voxel_type, part);
        }
        Ok(())
    }

    /// Adds a frame's row at a position between two of its rows.
    fn add_row(
        &self,
        n: usize,
        y: f64,
        weight: f64,
        region: Region,
        row: &mut [f64],
    ) -> Parsed<()> {
        let image = &self.images[self.place(n).0];
        let last = f64::from(image.rows - 1);
        if y < -0.5 || y > last + 0.5 {
            row.iter_mut().for_each(|sum| *sum += weight * self.filler);
            return Ok(());
        }
        let y = y.clamp(0.0, last);
        let numbers = self.numbers(n);
        let numbers = numbers.wait().as_ref().map_err(String::clone)?;
        let lower = y.floor();
        let share = y - lower;
        for (y, weight) in [
            (lower, weight * (1.0 - share)),
            (lower + 1.0, weight * share),
        ] {
            if weight > 0.0 {
                let first = y as usize * image.columns as usize + region.low[0] as usize;
                add(
                    &numbers[first * self.voxel_type.bytes()..],
                    self.voxel_type,
                    weight,
                    row,
                );
            }
        }
        Ok(())
    }
}

/// Adds numbers, times a weight, to sums.
pub fn add(numbers: &[u8], voxel_type: VoxelType, weight: f64, sums: &mut [f64]) {
    fn each<const N: usize>(
        numbers: &[u8],
        weight: f64,
        sums: &mut [f64],
        number: impl Fn([u8; N]) -> f64,
    ) {
        for (sum, bytes) in sums.iter_mut().zip(numbers.as_chunks().0) {
            *sum += weight * number(*bytes);
        }
    }
    match voxel_type {
        VoxelType::U8 => each(numbers, weight, sums, |bytes| {
            u8::from_ne_bytes(bytes).into()
        }),
        VoxelType::I8 => each(numbers, weight, sums, |bytes| {
            i8::from_ne_bytes(bytes).into()
        }),
        VoxelType::U16 => each(numbers, weight, sums, |bytes| {
            u16::from_ne_bytes(bytes).into()
        }),
        VoxelType::I16 => each(numbers, weight, sums, |bytes| {
            i16::from_ne_bytes(bytes).into()
        }),
        VoxelType::U32 => each(numbers, weight, sums, |bytes| {
            u32::from_ne_bytes(bytes).into()
        }),
        VoxelType::I32 => each(numbers, weight, sums, |bytes| {
            i32::from_ne_bytes(bytes).into()
        }),
        _ => each(numbers, weight, sums, |bytes| {
            f32::from_ne_bytes(bytes).into()
        }),
    }
}

/// Writes numbers; integers are rounded to the nearest.
fn write(row: &[f64], voxel_type: VoxelType, bytes: &mut [u8]) {
    fn each<const N: usize>(row: &[f64], bytes: &mut [u8], number: impl Fn(f64) -> [u8; N]) {
        for (bytes, value) in bytes.as_chunks_mut().0.iter_mut().zip(row) {
            *bytes = number(*value);
        }
    }
    match voxel_type {
        VoxelType::U8 => each(row, bytes, |value| (value.round() as u8).to_ne_bytes()),
        VoxelType::I8 => each(row, bytes, |value| (value.round() as i8).to_ne_bytes()),
        VoxelType::U16 => each(row, bytes, |value| (value.round() as u16).to_ne_bytes()),
        VoxelType::I16 => each(row, bytes, |value| (value.round() as i16).to_ne_bytes()),
        VoxelType::U32 => each(row, bytes, |value| (value.round() as u32).to_ne_bytes()),
        VoxelType::I32 => each(row, bytes, |value| (value.round() as i32).to_ne_bytes()),
        _ => each(row, bytes, |value| (value as f32).to_ne_bytes()),
    }
}

impl Source for Slices {
    fn is_random(&self) -> bool {
        true
    }

    fn files(&self) -> Vec<PathBuf> {
        let paths = self.images.iter().map(|image| image.place.path.clone());
        paths.collect()
    }

    fn cursor(&self) -> Box<dyn Cursor + '_> {
        Box::new(self)
    }
}

impl Cursor for &Slices {
    fn read(&mut self, region: Region, bytes: &mut [u8]) -> Parsed<()> {
        let [x, y, z] = region.dims.map(|size| size as usize);
        let slice_bytes = x * y * self.voxel_type.bytes();
        let slices = &self.stack.slices[region.low[2] as usize..][..z];
        for (slice, part) in slices.iter().zip(bytes.chunks_exact_mut(slice_bytes)) {
            self.read_slice(*slice, region, part)?;
        }
        Ok(())
    }
}
