//! How voxels are cut into chunks.
//!
//! A chunk repeats the first voxels of the chunks behind it, as a brick on the GPU does, and begins where a brick
//! does, every [`BRICK_SIDE`] voxels along x and y, and along z where slices are not too large. So one chunk gives the voxels of a brick; without the repetition it would take eight, nearly all of them
//! decoded for nothing.

use crate::scene::volume::region::{BRICK_SIDE, Region};

/// Bytes of all chunks at one height, which are in memory together while a store is written.
const MOST_LAYER: u64 = 320 << 20;

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Layout {
    pub dims: [u32; 3],
    pub voxel_bytes: usize,
    /// Voxels from a chunk to the next.
    pub step: [u32; 3],
}

/// The part of a region in a chunk, along one axis.
#[derive(Debug, Clone, Copy)]
pub struct Span {
    pub chunk: u32,
    /// Voxels [low, high) of the volume.
    pub low: u32,
    pub high: u32,
}

impl Layout {
    pub fn new(dims: [u32; 3], voxel_bytes: usize) -> Layout {
        let slice = u64::from(dims[0]) * u64::from(dims[1]) * voxel_bytes as u64;
        let mut depth = BRICK_SIDE;
        while depth > 1 && u64::from(depth + 1) * slice > MOST_LAYER {
            depth /= 2;
        }
        Layout {
            dims,
            voxel_bytes,
            step: [BRICK_SIDE, BRICK_SIDE, depth],
        }
    }

    /// Chunks along each axis.
    pub fn counts(&self) -> [u32; 3] {
        std::array::from_fn(|a| self.dims[a].div_ceil(self.step[a]))
    }

    pub fn total(&self) -> usize {
        self.counts().iter().map(|&n| n as usize).product()
    }

    pub fn index(&self, [i, j, k]: [u32; 3]) -> usize {
        let [x, y, _] = self.counts().map(|n| n as usize);
        (k as usize * y + j as usize) * x + i as usize
    }

    /// The voxels of a chunk.
    pub fn region(&self, at: [u32; 3]) -> Region {
        let low: [u32; 3] = std::array::from_fn(|a| at[a] * self.step[a]);
        Region {
            low,
            dims: std::array::from_fn(|a| (self.step[a] + 1).min(self.dims[a] - low[a])),
        }
    }

    /// The fewest chunks that hold a region along an axis.
    pub fn spans(&self, region: Region, a: usize) -> Vec<Span> {
        let step = self.step[a];
        let [low, end] = [region.low[a], region.low[a] + region.dims[a]];
        let first = low / step;
        // The last voxel may be one that the previous chunk repeats.
        let last = first.max((end - 1).saturating_sub(1) / step);
        let span = |chunk: u32| Span {
            chunk,
            low: low.max(chunk * step),
            high: if chunk == last {
                end
            } else {
                (chunk + 1) * step
            },
        };
        (first..=last).map(span).collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn spans_cover_a_region_once_and_lie_in_their_chunks() {
        for size in [1, 31, 32, 33, 64, 65, 100] {
            let layout = Layout::new([size, 5, 5], 2);
            for low in 0..size {
                for high in low + 1..=size {
                    let region = Region {
                        low: [low, 0, 0],
                        dims: [high - low, 5, 5],
                    };
                    let mut next = low;
                    for span in layout.spans(region, 0) {
                        let chunk = layout.region([span.chunk, 0, 0]);
                        assert_eq!(span.low, next);
                        assert!(span.low >= chunk.low[0]);
                        assert!(span.high <= chunk.low[0] + chunk.dims[0]);
                        next = span.high;
                    }
                    assert_eq!(next, high, "{size}: {low}..{high}");
                }
            }
        }
    }

    #[test]
    fn a_brick_is_one_chunk() {
        let layout = Layout::new([100; 3], 1);
        let brick = layout.region([1, 0, 3]);
        assert!((0..3).all(|a| layout.spans(brick, a).len() == 1));
    }

    #[test]
    fn large_slices_make_flat_chunks() {
        let layout = Layout::new([16384, 16384, 100], 4);
        assert_eq!(layout.step, [32, 32, 1]);
    }
}
