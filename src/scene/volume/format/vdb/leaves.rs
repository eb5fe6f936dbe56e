//! The voxels of a grid as a source: chunks, each put together from the leaves that lie in it.

use std::path::PathBuf;
use std::sync::OnceLock;

use super::archive::GridHead;
use super::mask::Mask;
use super::packed::Packed;
use super::stream::{BLOCK, Stream};
use super::tree::{Found, LEAF_SIDE, LEAF_VOXELS, Tree};
use crate::scene::volume::parsed::Parsed;
use crate::scene::volume::source::chunked::{Chunks, Content};
use crate::scene::volume::source::watched::WatchedFile;

#[derive(Debug)]
pub struct Leaves {
    file: WatchedFile,
    grid: GridHead,
    tree: Tree,
    /// Voxels of a chunk along each axis.
    chunk: [u32; 3],
    /// The leaves' places in the file. They are found when the first voxel is read, since that takes a walk through all
    /// leaves.
    places: OnceLock<Parsed<Vec<Place>>>,
}

/// A leaf's mask and values, as bytes of the file.
#[derive(Debug, Clone, Copy)]
struct Place {
    at: u64,
    bytes: u32,
}

impl Leaves {
    pub fn new(file: WatchedFile, grid: GridHead, tree: Tree, chunk: [u32; 3]) -> Leaves {
        Leaves {
            file,
            grid,
            tree,
            chunk,
            places: OnceLock::new(),
        }
    }

    fn places(&self) -> Parsed<&[Place]> {
        let places = self.places.get_or_init(|| self.find_places());
        places.as_deref().map_err(String::clone)
    }

    fn find_places(&self) -> Parsed<Vec<Place>> {
        let mut stream = Stream::new(&self.file, self.grid.leaves, BLOCK);
        let mut places = Vec::with_capacity(self.tree.leaves);
        for _ in 0..self.tree.leaves {
            let at = stream.at();
            let mask = Mask::read(&mut stream, LEAF_VOXELS)?;
            self.packed(&mut stream, &mask)?.skip(&mut stream)?;
            let bytes = (stream.at() - at) as u32;
            places.push(Place { at, bytes });
        }
        Ok(places)
    }

    fn packed<'m>(&self, stream: &mut Stream, mask: &'m Mask) -> Parsed<Packed<'m>> {
        let GridHead {
            number,
            compression,
            ..
        } = self.grid;
        Packed::read(stream, number, compression, &self.tree.background, mask)
    }

    fn unpack(&self, place: Place) -> Parsed<Vec<u8>> {
        let mut stream = Stream::new(&self.file, place.at, place.bytes.into());
        let mask = Mask::read(&mut stream, LEAF_VOXELS)?;
        self.packed(&mut stream, &mask)?.unpack(&mut stream)
    }

    /// Copies the part of a leaf that lies in a chunk to its place. `BYTES` is the size of a number; `leaf_low` and
    /// `chunk_low` are the lowest voxels of both.
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

    fn decode(&self, at: [u32; 3]) -> Parsed<Content> {
        let places = self.places()?;
        let [first, end] = self.tree.active();
        let side = |a: usize| i64::from(self.chunk[a]);
        let low: [i64; 3] = std::array::from_fn(|a| first[a] + i64::from(at[a]) * side(a));
        let background = &self.tree.background;
        let voxels = self.chunk.iter().map(|size| *size as usize).product();
        let mut chunk = background.repeat(voxels);
        // The first leaf along an axis may begin before the chunk.
        let leaves = |a: usize| {
            let first = low[a].div_euclid(LEAF_SIDE) * LEAF_SIDE;
            (first..(low[a] + side(a)).min(end[a])).step_by(LEAF_SIDE as usize)
        };
        let leaves =
            leaves(2).flat_map(|z| leaves(1).flat_map(move |y| leaves(0).map(move |x| [x, y, z])));
        for leaf in leaves {
            let values = match self.tree.find(leaf) {
                Found::Value(value) if value == background => continue,
                Found::Value(value) => value.repeat(LEAF_VOXELS),
                Found::Leaf(number) => self.unpack(places[number])?,
            };
            match background.len() {
                2 => self.put::<2>(&values, leaf, &mut chunk, low),
                4 => self.put::<4>(&values, leaf, &mut chunk, low),
                _ => self.put::<8>(&values, leaf, &mut chunk, low),
            }
        }
        Ok(Content::Voxels(chunk))
    }
}
