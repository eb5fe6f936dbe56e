//! Voxels in equal boxes, each compressed on its own: strips and tiles of TIFF pages, chunks of Zarr arrays.
//!
//! A voxel can only be read with all others of its chunk. So a region is read chunk by chunk, a batch at a time: all
//! cores decode, and then all cores copy rows to their places. A whole volume is read in pieces that end where chunks
//! do ([`pieces`](Chunked::pieces)), so that each chunk is decoded once. Chunks that a region has cut are kept for a
//! while, since the next region is likely to need them.

use std::collections::{HashMap, VecDeque};
use std::fmt;
use std::ops::Range;
use std::path::PathBuf;
use std::sync::{Arc, Mutex, MutexGuard};

use rayon::prelude::*;

use super::{Access, Cursor, Source};
use crate::locked::locked;
use crate::scene::volume::parsed::Parsed;
use crate::scene::volume::region::Region;

/// Decoded bytes of the chunks that are decoded at a time, if one for each core is not more.
const BATCH: usize = 8 << 20;
const MOST_AT_ONCE: usize = 4096;
/// Decoded bytes that are kept for later. A volume that is no larger is kept whole.
const KEPT: usize = 32 << 20;

/// The voxels of a chunk.
#[derive(Debug)]
pub enum Content {
    /// x fastest, in rows as long as a chunk's, and at least those within the volume.
    Voxels(Vec<u8>),
    /// Every voxel of the chunk has this value.
    Uniform(Vec<u8>),
}

impl Content {
    /// Approximate memory of a chunk that is kept: at least that of its entry in the tables.
    fn bytes(&self) -> usize {
        const PLACE: usize = 128;
        match self {
            Content::Voxels(bytes) | Content::Uniform(bytes) => bytes.len().max(PLACE),
        }
    }
}

/// Access to single chunks.
pub trait Chunks: fmt::Debug + Send + Sync {
    /// The chunk at `at`, counted in chunks along x, y and z.
    fn decode(&self, at: [u32; 3]) -> Parsed<Content>;

    /// All files that chunks are read from.
    fn files(&self) -> Vec<PathBuf>;
}

/// Converts a run of decoded voxels into its destination and returns the largest change by rounding.
pub type Put<'a> = dyn Fn(&[u8], &mut [u8]) -> Parsed<f64> + Sync + 'a;

#[derive(Debug)]
pub struct Chunked {
    dims: [u32; 3],
    /// Voxels of a chunk along each axis.
    chunk: [u32; 3],
    voxel_bytes: usize,
    chunks: Box<dyn Chunks>,
    kept: Mutex<Kept>,
}

impl Chunked {
    pub fn new(
        dims: [u32; 3],
        chunk: [u32; 3],
        voxel_bytes: usize,
        chunks: Box<dyn Chunks>,
    ) -> Chunked {
        Chunked {
            dims,
            chunk,
            voxel_bytes,
            chunks,
            kept: Mutex::default(),
        }
    }

    /// Boxes of at most `most` voxels (at least one) that cover a region: layers of chunks, or else rows of chunks,
    /// or else some chunks of one row, or else parts of one chunk.
    pub fn pieces(&self, region: Region, most: usize) -> impl Iterator<Item = Region> + use<> {
        let [x, y, z] = self.chunk;
        let [width, height, _] = region.dims;
        let of = |a: u32, b: u32, c: u32| a as usize * b as usize * c as usize;
        let times = |n: u32, voxels: usize| {
            let most = (most / voxels).clamp(1, u32::MAX as usize) as u32;
            n.saturating_mul(most)
        };
        let step = if most >= of(width, height, z) {
            [u32::MAX, u32::MAX, times(z, of(width, height, z))]
        } else if most >= of(width, y, z) {
            [u32::MAX, times(y, of(width, y, z)), z]
        } else {
            [times(x, of(x, y, z)), y, z]
        };
        let along = move |a: usize| {
            let [low, high] = [region.low[a], region.low[a] + region.dims[a]];
            let first = low / step[a];
            (first..=(high - 1) / step[a]).map(move |n| {
                let begin = low.max(n * step[a]);
                let end = high.min(n.saturating_add(1).saturating_mul(step[a]));
                (begin, end - begin)
            })
        };
        let boxes = along(2)
            .flat_map(move |z| along(1).flat_map(move |y| along(0).map(move |x| [x, y, z])));
        boxes.flat_map(move |spans| {
            let piece = Region {
                low: spans.map(|(low, _)| low),
                dims: spans.map(|(_, size)| size),
            };
            piece.pieces(most)
        })
    }

    /// Fills `bytes` with a region, `placed_bytes` for each voxel. Returns the largest result of `place`.
    pub fn read(
        &self,
        region: Region,
        bytes: &mut [u8],
        placed_bytes: usize,
        place: &Put,
    ) -> Parsed<f64> {
        let chunk_bytes = self.voxel_bytes * Region::whole(self.chunk).voxels();
        let fitting = (BATCH / chunk_bytes.max(1)).min(MOST_AT_ONCE);
        let count = fitting.max(rayon::current_num_threads());
        let mut touched = self.touched(region);
        let mut largest: f64 = 0.0;
        loop {
            let batch: Vec<[u32; 3]> = touched.by_ref().take(count).collect();
            if batch.is_empty() {
                return Ok(largest);
            }
            let decoded = batch.into_par_iter().map(|at| self.chunk(at, region));
            // All results are collected, so that the first fault is always the one that is reported.
            let decoded: Vec<Parsed<Chunk>> = decoded.collect();
            let decoded: Vec<Chunk> = decoded.into_iter().collect::<Parsed<_>>()?;
            largest = largest.max(put(&decoded, region, bytes, placed_bytes, place)?);
        }
    }

    /// The chunks that hold voxels of a region, in the region's order.
    fn touched(&self, region: Region) -> impl Iterator<Item = [u32; 3]> {
        let along = move |a: usize| -> Range<u32> {
            let last = region.low[a] + (region.dims[a] - 1);
            region.low[a] / self.chunk[a]..last / self.chunk[a] + 1
        };
        along(2).flat_map(move |z| along(1).flat_map(move |y| along(0).map(move |x| [x, y, z])))
    }

    fn chunk(&self, at: [u32; 3], wanted: Region) -> Parsed<Chunk> {
        let low: [u32; 3] = std::array::from_fn(|a| at[a] * self.chunk[a]);
        let inside = Region {
            low,
            dims: std::array::from_fn(|a| self.chunk[a].min(self.dims[a] - low[a])),
        };
        let is_kept = self.is_small() || !inside.lies_inside(&wanted);
        let known = self.kept().chunks.get(&at).cloned();
        let content = match known {
            Some(content) => content,
            None => {
                let content = Arc::new(self.decoded(at, inside)?);
                if is_kept {
                    self.kept().keep(at, content.clone());
                }
                content
            }
        };
        Ok(Chunk {
            inside,
            row_bytes: self.chunk[0] as usize * self.voxel_bytes,
            rows: self.chunk[1] as usize,
            voxel_bytes: self.voxel_bytes,
            content,
        })
    }

    fn decoded(&self, at: [u32; 3], inside: Region) -> Parsed<Content> {
        let content = self.chunks.decode(at)?;
        let Content::Voxels(voxels) = &content else {
            return Ok(content);
        };
        let [x, y, z] = inside.dims.map(|size| size as usize);
        let [width, height, _] = self.chunk.map(|size| size as usize);
        let last = ((z - 1) * height + y - 1) * width + x;
        if voxels.len() >= last * self.voxel_bytes {
            Ok(content)
        } else {
            Err(format!(
                "a chunk of it decodes to {} bytes, expected {}: the file is damaged",
                voxels.len(),
                last * self.voxel_bytes
            ))
        }
    }

    fn is_small(&self) -> bool {
        let bytes = Region::whole(self.dims).voxels() * self.voxel_bytes;
        bytes <= KEPT
    }

    fn kept(&self) -> MutexGuard<'_, Kept> {
        locked(&self.kept)
    }
}

impl Source for Chunked {
    fn access(&self) -> Access {
        Access::Decoded
    }

    fn files(&self) -> Vec<PathBuf> {
        self.chunks.files()
    }

    fn cursor(&self) -> Box<dyn Cursor + '_> {
        Box::new(self)
    }

    fn chunked(&self) -> Option<&Chunked> {
        Some(self)
    }
}

impl Cursor for &Chunked {
    fn read(&mut self, region: Region, bytes: &mut [u8]) -> Parsed<()> {
        let place = |voxels: &[u8], place: &mut [u8]| {
            place.copy_from_slice(voxels);
            Ok(0.0)
        };
        Chunked::read(self, region, bytes, self.voxel_bytes, &place).map(|_| ())
    }
}

/// Chunks that were decoded lately; the oldest are removed first.
#[derive(Debug, Default)]
struct Kept {
    chunks: HashMap<[u32; 3], Arc<Content>>,
    order: VecDeque<[u32; 3]>,
    bytes: usize,
}

impl Kept {
    fn keep(&mut self, at: [u32; 3], content: Arc<Content>) {
        self.bytes += content.bytes();
        match self.chunks.insert(at, content) {
            Some(same) => self.bytes -= same.bytes(),
            None => self.order.push_back(at),
        }
        while self.bytes > KEPT
            && self.order.len() > 1
            && let Some(oldest) = self.order.pop_front()
        {
            let oldest = self.chunks.remove(&oldest);
            self.bytes -= oldest.map_or(0, |content| content.bytes());
        }
    }
}

/// A decoded chunk, cut off at the volume's end.
struct Chunk {
    inside: Region,
    row_bytes: usize,
    /// Rows of a slice, those outside of the volume included.
    rows: usize,
    voxel_bytes: usize,
    content: Arc<Content>,
}

/// Copies the parts of a region from chunks to their places, a slice of the region on each core.
fn put(
    chunks: &[Chunk],
    region: Region,
    bytes: &mut [u8],
    placed_bytes: usize,
    place: &Put,
) -> Parsed<f64> {
    let slice_bytes = region.dims[0] as usize * region.dims[1] as usize * placed_bytes;
    let first = chunks.iter().map(|chunk| chunk.inside.low[2]).min();
    let first = first.unwrap_or(0).max(region.low[2]) - region.low[2];
    let end = chunks
        .iter()
        .map(|c| c.inside.low[2] + c.inside.dims[2])
        .max();
    let end = end.unwrap_or(0).min(region.low[2] + region.dims[2]) - region.low[2];
    let slices = bytes[first as usize * slice_bytes..end as usize * slice_bytes]
        .par_chunks_mut(slice_bytes)
        .enumerate();
    let losses = slices.map(|(n, slice)| {
        let k = region.low[2] + first + n as u32;
        let here = chunks.iter().filter(|chunk| chunk.has_slice(k));
        here.map(|chunk| chunk.put_slice(k, region, slice, placed_bytes, place))
            .try_fold(0.0, |largest: f64, loss| Ok(largest.max(loss?)))
    });
    let losses: Vec<Parsed<f64>> = losses.collect();
    losses
        .into_iter()
        .try_fold(0.0, |largest: f64, loss| Ok(largest.max(loss?)))
}

impl Chunk {
    fn has_slice(&self, k: u32) -> bool {
        (self.inside.low[2]..self.inside.low[2] + self.inside.dims[2]).contains(&k)
    }

    fn put_slice(
        &self,
        k: u32,
        region: Region,
        slice: &mut [u8],
        placed_bytes: usize,
        place: &Put,
    ) -> Parsed<f64> {
        let [x, y] = [0, 1].map(|a| {
            let begin = self.inside.low[a].max(region.low[a]);
            let end =
                (self.inside.low[a] + self.inside.dims[a]).min(region.low[a] + region.dims[a]);
            begin..end
        });
        let first_row = (k - self.inside.low[2]) as usize * self.rows;
        let uniform = match &*self.content {
            Content::Voxels(_) => Vec::new(),
            Content::Uniform(voxel) => voxel.repeat(x.len()),
        };
        // Rows that follow one another in both places are one run.
        let is_row = uniform.is_empty()
            && x.len() as u32 == region.dims[0]
            && x.len() * self.voxel_bytes == self.row_bytes;
        let (rows, width) = if is_row {
            (y.start..y.start + 1, x.len() * y.len())
        } else {
            (y, x.len())
        };
        let mut largest: f64 = 0.0;
        for j in rows {
            let row = first_row + (j - self.inside.low[1]) as usize;
            let column = (x.start - self.inside.low[0]) as usize;
            let from = row * self.row_bytes + column * self.voxel_bytes;
            let to = (j - region.low[1]) as usize * region.dims[0] as usize
                + (x.start - region.low[0]) as usize;
            let run = match &*self.content {
                Content::Voxels(voxels) => &voxels[from..from + width * self.voxel_bytes],
                Content::Uniform(_) => &uniform[..],
            };
            let loss = place(run, &mut slice[to * placed_bytes..][..width * placed_bytes])?;
            largest = largest.max(loss);
        }
        Ok(largest)
    }
}
