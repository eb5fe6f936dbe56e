//! A volume's stored values, read from its source on demand: cropped, converted, and with their slices in reverse
//! where the file's axes are left-handed.
//!
//! To read all of them, take [`Volume::pieces`](super::Volume::pieces), which come in the order in which the source
//! is read fastest, and read one after another through one [`Reader`]. In this way a volume larger than memory passes
//! through a small buffer, and a compressed file is inflated only once. If the source can give any region at once,
//! all cores read a share of each piece.

use rayon::prelude::*;

use super::parsed::Parsed;
use super::region::Region;
use super::source::chunked::Chunked;
use super::source::memory::Memory;
use super::source::{Access, Cursor, Source};
use super::stored::{Conversion, StoredType, Voxels};
use crate::error::{Error, Location, Result};

/// Bytes read at a time where they have to be converted, so that they stay in the processor's cache.
const CHUNK: usize = 256 << 10;
/// Stored bytes that a core reads before it takes the next share.
const SHARE: usize = 1 << 20;

/// The stored values of a volume, and how to read them.
#[derive(Debug)]
pub(super) struct Grid {
    pub source: Box<dyn Source>,
    /// The part of the source's voxels that the volume has, in the source's own coordinates.
    pub region: Region,
    /// Whether slice 0 is the source's last.
    pub is_mirrored: bool,
    pub conversion: Conversion,
    /// The value in place of those that are not finite, if there are any.
    pub filler: Option<f32>,
    /// The file, for messages.
    pub name: String,
}

impl Grid {
    pub fn dims(&self) -> [u32; 3] {
        self.region.dims
    }

    pub fn stored(&self) -> StoredType {
        self.conversion.stored()
    }

    /// Boxes of at most `most` voxels that cover everything, in the source's order.
    pub fn pieces(&self, most: usize) -> Box<dyn Iterator<Item = Region> + '_> {
        match self.source.chunked() {
            Some(chunked) => {
                let pieces = chunked.pieces(self.region, most);
                Box::new(pieces.map(|piece| self.turned(piece.outside(&self.region))))
            }
            None => {
                let pieces = Region::whole(self.dims()).pieces(most);
                Box::new(pieces.map(|piece| self.turned(piece)))
            }
        }
    }

    /// Reads these voxels from now on, which are all that it has, as they are stored.
    pub fn keep(&mut self, voxels: Voxels) {
        let (dims, stored) = (self.dims(), self.stored());
        self.source = Box::new(Memory { dims, voxels });
        self.region = Region::whole(dims);
        self.conversion = Conversion::none(stored);
    }

    pub fn reader(&self) -> Reader<'_> {
        Reader {
            grid: self,
            cursor: (self.source.access() == Access::Sequential).then(|| self.source.cursor()),
            rounding: 0.0,
        }
    }

    /// All voxels, if they are in memory in this form.
    pub fn resident(&self) -> Option<&Voxels> {
        let is_whole = self.region.low == [0; 3] && !self.is_mirrored;
        let is_same = self.conversion.is_none() && self.filler.is_none();
        self.source.resident().filter(|_| is_whole && is_same)
    }

    /// Converts a box between the volume's order of slices and the source's.
    fn turned(&self, region: Region) -> Region {
        if self.is_mirrored {
            region.mirrored(self.dims()[2])
        } else {
            region
        }
    }

    /// Converts voxels as the source has them into stored values. Returns the largest change by rounding.
    fn place(&self, voxels: &[u8], stored: &mut [u8]) -> Parsed<f64> {
        let rounding = if self.conversion.is_none() {
            stored.copy_from_slice(voxels);
            0.0
        } else {
            self.conversion.convert(voxels, stored)?
        };
        self.fill_infinite(stored);
        Ok(rounding)
    }

    fn fill_infinite(&self, stored: &mut [u8]) {
        let Some(filler) = self.filler else {
            return;
        };
        for bytes in stored.as_chunks_mut().0 {
            if !f32::from_ne_bytes(*bytes).is_finite() {
                *bytes = filler.to_ne_bytes();
            }
        }
    }

    /// Reads a region chunk by chunk with all cores. Returns the largest change by rounding.
    fn read_chunks(&self, chunked: &Chunked, region: Region, stored: &mut [u8]) -> Parsed<f64> {
        let wanted = self.turned(region).within(&self.region);
        let place = |voxels: &[u8], stored: &mut [u8]| self.place(voxels, stored);
        let rounding = chunked.read(wanted, stored, self.stored().bytes(), &place)?;
        if self.is_mirrored {
            reverse_slices(stored, region.dims[2] as usize);
        }
        Ok(rounding)
    }

    /// Reads a region through a cursor. Returns the largest change by rounding.
    fn read(&self, cursor: &mut dyn Cursor, region: Region, stored: &mut [u8]) -> Parsed<f64> {
        let mut rounding: f64 = 0.0;
        let wanted = self.turned(region).within(&self.region);
        if self.conversion.is_none() {
            cursor.read(wanted, stored)?;
        } else {
            let from = self.conversion.from.bytes();
            let mut chunk = vec![0; CHUNK.min(wanted.voxels() * from)];
            let mut rest = &mut *stored;
            for piece in wanted.pieces(CHUNK / from) {
                let bytes = &mut chunk[..piece.voxels() * from];
                cursor.read(piece, bytes)?;
                let (converted, later) = rest.split_at_mut(piece.voxels() * self.stored().bytes());
                rounding = rounding.max(self.conversion.convert(bytes, converted)?);
                rest = later;
            }
        }
        self.fill_infinite(stored);
        if self.is_mirrored {
            reverse_slices(stored, region.dims[2] as usize);
        }
        Ok(rounding)
    }
}

/// Reads regions of a volume, fastest in the order of [`Volume::pieces`](super::Volume::pieces).
pub struct Reader<'a> {
    grid: &'a Grid,
    /// The position from which to continue, if the source is best read from front to back.
    cursor: Option<Box<dyn Cursor + 'a>>,
    /// The largest change that rounding to f32 has made.
    pub(super) rounding: f64,
}

impl Reader<'_> {
    /// Fills `bytes` with the stored values of a region, x fastest, in the byte order of this machine.
    ///
    /// # Errors
    ///
    /// If the file cannot be read any more or has changed, if the region leaves the volume, or if `bytes` has another
    /// length.
    pub fn read(&mut self, region: Region, bytes: &mut [u8]) -> Result<()> {
        let grid = self.grid;
        let fits = region.lies_within(grid.dims())
            && bytes.len() == region.voxels() * grid.stored().bytes();
        let read = if fits {
            self.fill(region, bytes)
        } else {
            Err(format!(
                "{} bytes were to hold {:?} voxels from {:?} on of a volume of {:?}, expected the size \
                 of a region inside it",
                bytes.len(),
                region.dims,
                region.low,
                grid.dims()
            ))
        };
        read.map_err(|fault| Error::input(Location::file(&grid.name), fault))
    }

    pub(super) fn fill(&mut self, region: Region, bytes: &mut [u8]) -> Parsed<()> {
        let grid = self.grid;
        let rounding = match (&mut self.cursor, grid.source.chunked()) {
            (Some(cursor), _) => grid.read(&mut **cursor, region, bytes)?,
            (None, Some(chunked)) => grid.read_chunks(chunked, region, bytes)?,
            (None, None) => {
                let shares = shares_mut(region, bytes, grid.stored().bytes());
                let read = |(region, bytes)| grid.read(&mut *grid.source.cursor(), region, bytes);
                // All results are collected, so that the first fault is always the one that is reported.
                let changes: Vec<Parsed<f64>> = shares.into_par_iter().map(read).collect();
                let largest = |a: f64, b: Parsed<f64>| Ok::<f64, String>(a.max(b?));
                changes.into_iter().try_fold(0.0, largest)?
            }
        };
        self.rounding = self.rounding.max(rounding);
        Ok(())
    }
}

/// Parts of a region, each with the bytes of its values.
fn shares_mut(region: Region, bytes: &mut [u8], size: usize) -> Vec<(Region, &mut [u8])> {
    let mut rest = bytes;
    let pieces = region.pieces(SHARE / size);
    let share = |piece: Region| {
        let (share, later) = std::mem::take(&mut rest).split_at_mut(piece.voxels() * size);
        rest = later;
        (piece, share)
    };
    pieces.map(share).collect()
}

fn reverse_slices(bytes: &mut [u8], count: usize) {
    let slice = bytes.len() / count;
    for k in 0..count / 2 {
        let (front, back) = bytes.split_at_mut((count - 1 - k) * slice);
        front[k * slice..][..slice].swap_with_slice(&mut back[..slice]);
    }
}
