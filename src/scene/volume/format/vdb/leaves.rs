//! The voxels of a grid as a source: chunks, each put together from the leaves that lie in it.

use std::path::PathBuf;

use super::mask::Mask;
use super::number::Number;
use super::packed::{Compression, Packed};
use super::stream::Stream;
use super::tree::{Found, LEAF_SIDE, LEAF_VOXELS, Leaf, Tree};
use crate::scene::volume::parsed::Parsed;
use crate::scene::volume::source::chunked::Chunks;
use crate::scene::volume::source::watched::WatchedFile;

#[derive(Debug)]
pub struct Leaves {
    file: WatchedFile,
    number: Number,
    compression: Compression,
    tree: Tree,
    /// Voxels of a chunk along each axis.
    chunk: [u32; 3],
}

impl Leaves {
    pub fn new(
        file: WatchedFile,
        number: Number,
        compression: Compression,
        tree: Tree,
        chunk: [u32; 3],
    ) -> Leaves {
        Leaves {
            file,
            number,
            compression,
            tree,
            chunk,
        }
    }

    fn unpack(&self, leaf: Leaf) -> Parsed<Vec<u8>> {
        let mut stream = Stream::new(&self.file, leaf.at, leaf.bytes.into());
        let mask = Mask::read(&mut stream, LEAF_VOXELS)?;
        let packed = Packed::read(
            &mut stream,
            self.number,
            self.compression,
            &self.tree.background,
            &mask,
        )?;
        packed.unpack(&mut stream)
    }
}

impl Leaves {
    /// Copies the part of a leaf that lies in a chunk to its place. `BYTES` is the size of a number; both lowest voxels
    /// are given.
    fn put<const BYTES: usize>(
        &self,
        leaf: &[u8],
        leaf_low: [i64; 3],
        chunk: &mut [u8],
        chunk_low: [i64; 3],
    ) {
        let (leaf, _) = leaf.as_chunks::<BYTES>();
        let (chunk, _) = chunk.as_chunks_mut::<BYTES>();
        let overlap = |a: usize| {
            let end = chunk_low[a] + i64::from(self.chunk[a]);
            let begin = leaf_low[a].max(chunk_low[a]);
            (begin, (leaf_low[a] + LEAF_SIDE).min(end) - begin)
        };
        let [(x, width), (y, height), (z, depth)] = [overlap(0), overlap(1), overlap(2)];
        let side = LEAF_SIDE as usize;
        for k in z..z + depth {
            for j in y..y + height {
                let from = (x - leaf_low[0]) * LEAF_SIDE + j - leaf_low[1];
                let from = (from * LEAF_SIDE + k - leaf_low[2]) as usize;
                let to = (k - chunk_low[2]) * i64::from(self.chunk[1]) + j - chunk_low[1];
                let to = (to * i64::from(self.chunk[0]) + x - chunk_low[0]) as usize;
                let row = &mut chunk[to..to + width as usize];
                let column = leaf[from..].iter().step_by(side * side);
                for (voxel, value) in row.iter_mut().zip(column) {
                    *voxel = *value;
                }
            }
        }
    }
}

impl Chunks for Leaves {
    fn files(&self) -> Vec<PathBuf> {
        vec![self.file.path().to_path_buf()]
    }

    fn decode(&self, at: [u32; 3]) -> Parsed<Vec<u8>> {
        let first = self.tree.low();
        let low: [i64; 3] =
            std::array::from_fn(|a| first[a] + i64::from(at[a]) * i64::from(self.chunk[a]));
        let high: [i64; 3] = std::array::from_fn(|a| low[a] + i64::from(self.chunk[a]));
        let bytes = self.number.bytes();
        let voxels = self.chunk.iter().map(|size| *size as usize).product();
        let mut chunk = self.tree.background.repeat(voxels);
        // Chunks and leaves do not begin at the same places.
        let leaves = |a: usize| {
            let first = low[a].div_euclid(LEAF_SIDE) * LEAF_SIDE;
            (first..high[a]).step_by(LEAF_SIDE as usize)
        };
        let places =
            leaves(2).flat_map(|z| leaves(1).flat_map(move |y| leaves(0).map(move |x| [x, y, z])));
        for place in places {
            let values = match self.tree.find(place) {
                Found::Value(value) if value == self.tree.background => continue,
                Found::Value(value) => value.repeat(LEAF_VOXELS),
                Found::Leaf(leaf) => self.unpack(leaf)?,
            };
            match bytes {
                4 => self.put::<4>(&values, place, &mut chunk, low),
                _ => self.put::<8>(&values, place, &mut chunk, low),
            }
        }
        Ok(chunk)
    }
}
