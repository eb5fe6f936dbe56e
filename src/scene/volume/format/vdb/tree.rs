//! A grid's tree: the root's blocks of 4096³ voxels, their upper nodes with 32³ slots of 128³ voxels, lower nodes with
//! 16³ slots of 8³ voxels, and leaves with 8³ voxels (`openvdb/tree`). A slot holds a node, or one value for all of its
//! voxels. In every array z is the fastest index.
//!
//! A file may consist of little else than nodes, so a node whose slots all have one value keeps that value alone. Any other keeps
//! all of its slots' values, which is up to about 30 times what the file needs for them.

use std::collections::BTreeMap;

use super::archive::GridHead;
use super::mask::Mask;
use super::packed::Packed;
use super::stream::{BLOCK, Stream};
use crate::scene::volume::parsed::Parsed;
use crate::scene::volume::source::watched::WatchedFile;

/// A sort of nodes above the leaves.
struct Sort {
    /// Binary logarithm of the slots along each axis.
    log2: u32,
    /// Voxels of a slot along each axis.
    slot: i64,
}

const UPPER: Sort = Sort { log2: 5, slot: 128 };
const LOWER: Sort = Sort { log2: 4, slot: 8 };
/// Voxels along each axis of a root's block and of a leaf.
const BLOCK_SIDE: i64 = 4096;
pub const LEAF_SIDE: i64 = 8;
pub const LEAF_VOXELS: usize = 512;

impl Sort {
    fn slots(&self) -> usize {
        1 << (3 * self.log2)
    }

    /// The lowest voxel of a slot, from that of the node.
    fn low(&self, node: [i64; 3], slot: usize) -> [i64; 3] {
        let mask = (1 << self.log2) - 1;
        let along = [
            slot >> (2 * self.log2),
            slot >> self.log2 & mask,
            slot & mask,
        ];
        std::array::from_fn(|a| node[a] + along[a] as i64 * self.slot)
    }

    /// The slot in which a voxel lies.
    fn slot_of(&self, voxel: [i64; 3]) -> usize {
        let mask = (1 << self.log2) - 1;
        let [x, y, z] = voxel.map(|index| index.div_euclid(self.slot) as usize & mask);
        (x << self.log2 | y) << self.log2 | z
    }
}

#[derive(Debug)]
struct Node {
    /// The slots that have a child. Children of a node are numbered one after another.
    children: Mask,
    first_child: usize,
    /// The values of all slots, or one if they are all the same.
    values: Vec<u8>,
}

/// What a slot, or a block of the root, holds.
enum Slot<'a> {
    /// The number of a node.
    Child(usize),
    Value(&'a [u8]),
}

#[derive(Debug)]
enum Block {
    /// The number of an upper node.
    Node(usize),
    Value(Vec<u8>),
}

#[derive(Debug)]
pub struct Tree {
    pub background: Vec<u8>,
    /// The root's blocks, by their lowest voxel.
    blocks: BTreeMap<[i64; 3], Block>,
    upper: Vec<Node>,
    lower: Vec<Node>,
    /// Number of leaves.
    pub leaves: usize,
    /// The box of active voxels, up to but without its second corner.
    active: [[i64; 3]; 2],
}

/// What holds the values in a leaf's place.
pub enum Found<'a> {
    /// The leaf's number.
    Leaf(usize),
    /// All of its voxels have this value.
    Value(&'a [u8]),
}

impl Tree {
    pub fn read(file: &WatchedFile, grid: &GridHead) -> Parsed<Tree> {
        let mut stream = Stream::new(file, grid.nodes, BLOCK);
        // The number of buffers, which is always 1.
        stream.skip(4);
        let background = grid.number.read(&mut stream)?;
        let mut reader = TreeReader {
            stream,
            grid,
            tree: Tree {
                background,
                blocks: BTreeMap::new(),
                upper: Vec::new(),
                lower: Vec::new(),
                leaves: 0,
                active: [[i64::MAX; 3], [i64::MIN; 3]],
            },
        };
        reader.root()?;
        Ok(reader.tree)
    }

    /// The box of active voxels, up to but without its second corner.
    pub fn active(&self) -> [[i64; 3]; 2] {
        self.active
    }

    /// The size of the box of active voxels.
    pub fn dims(&self) -> Parsed<[u32; 3]> {
        let [low, high] = self.active;
        if low[0] > high[0] {
            let none = "it has no active voxel, expected at least one; pick another grid, or write this one with voxels in it";
            return Err(none.into());
        }
        let mut dims = [0; 3];
        for a in 0..3 {
            let size = high[a] - low[a];
            dims[a] = u32::try_from(size).map_err(|_| {
                let (axis, most) = (["x", "y", "z"][a], u32::MAX);
                format!("its active voxels span {size} voxels along {axis}, expected at most {most}; write a part of it")
            })?;
        }
        Ok(dims)
    }

    /// What holds the values of the leaf's place in which `voxel` lies.
    pub fn find(&self, voxel: [i64; 3]) -> Found<'_> {
        let block = voxel.map(|index| index.div_euclid(BLOCK_SIDE) * BLOCK_SIDE);
        let upper = match self.blocks.get(&block) {
            None => return Found::Value(&self.background),
            Some(Block::Value(value)) => return Found::Value(value),
            Some(Block::Node(upper)) => &self.upper[*upper],
        };
        let bytes = self.background.len();
        let lower = match upper.slot(UPPER.slot_of(voxel), bytes) {
            Slot::Value(value) => return Found::Value(value),
            Slot::Child(lower) => &self.lower[lower],
        };
        match lower.slot(LOWER.slot_of(voxel), bytes) {
            Slot::Value(value) => Found::Value(value),
            Slot::Child(leaf) => Found::Leaf(leaf),
        }
    }

    /// Makes the box of active voxels include a cube.
    fn include(&mut self, low: [i64; 3], side: i64) {
        let [lowest, highest] = &mut self.active;
        for a in 0..3 {
            lowest[a] = lowest[a].min(low[a]);
            highest[a] = highest[a].max(low[a] + side);
        }
    }
}

impl Node {
    /// What a slot holds. `bytes` is the size of a value.
    fn slot(&self, slot: usize, bytes: usize) -> Slot<'_> {
        if self.children.has(slot) {
            return Slot::Child(self.first_child + self.children.count_before(slot));
        }
        let at = if self.values.len() == bytes { 0 } else { slot };
        Slot::Value(&self.values[at * bytes..][..bytes])
    }
}

/// A tree of which a part has been read.
struct TreeReader<'a> {
    stream: Stream<'a>,
    grid: &'a GridHead,
    tree: Tree,
}

impl TreeReader<'_> {
    fn root(&mut self) -> Parsed<()> {
        let (values, nodes) = (self.stream.u32()?, self.stream.u32()?);
        for _ in 0..values {
            let low = self.stream.place()?;
            let value = self.grid.number.read(&mut self.stream)?;
            if self.stream.u8()? != 0 {
                self.tree.include(low, BLOCK_SIDE);
            }
            self.put(low, Block::Value(value))?;
        }
        let mut last = None;
        for _ in 0..nodes {
            let low = self.stream.place()?;
            // Leaves lie in this order in the file.
            if last.replace(low).is_some_and(|last| last >= low) {
                return Err("its blocks are not in their order: the file is damaged".into());
            }
            let upper = self.upper(low)?;
            self.tree.upper.push(upper);
            self.put(low, Block::Node(self.tree.upper.len() - 1))?;
        }
        Ok(())
    }

    fn put(&mut self, low: [i64; 3], block: Block) -> Parsed<()> {
        let is_block = low.iter().all(|index| index.rem_euclid(BLOCK_SIDE) == 0);
        if is_block && self.tree.blocks.insert(low, block).is_none() {
            Ok(())
        } else {
            Err(format!(
                "it has a block at {low:?}, expected multiples of {BLOCK_SIDE}, each once: the file is damaged"
            ))
        }
    }

    fn upper(&mut self, low: [i64; 3]) -> Parsed<Node> {
        let node = self.node(&UPPER, low, self.tree.lower.len())?;
        for slot in node.children.set() {
            let lower = self.lower(UPPER.low(low, slot))?;
            self.tree.lower.push(lower);
        }
        Ok(node)
    }

    fn lower(&mut self, low: [i64; 3]) -> Parsed<Node> {
        let node = self.node(&LOWER, low, self.tree.leaves)?;
        for slot in node.children.set() {
            self.leaf(LOWER.low(low, slot))?;
        }
        Ok(node)
    }

    /// A node without its children.
    fn node(&mut self, sort: &Sort, low: [i64; 3], first_child: usize) -> Parsed<Node> {
        let children = Mask::read(&mut self.stream, sort.slots())?;
        let active = Mask::read(&mut self.stream, sort.slots())?;
        let packed = Packed::read(
            &mut self.stream,
            self.grid.number,
            self.grid.compression,
            &self.tree.background,
            &active,
        )?;
        let mut values = packed.unpack(&mut self.stream)?;
        let bytes = self.tree.background.len();
        let (first, others) = values.split_at(bytes);
        if others.chunks_exact(bytes).all(|value| value == first) {
            values = first.to_vec();
        }
        for slot in active.set() {
            self.tree.include(sort.low(low, slot), sort.slot);
        }
        Ok(Node {
            children,
            first_child,
            values,
        })
    }

    /// A leaf's mask. Its values stand elsewhere.
    fn leaf(&mut self, low: [i64; 3]) -> Parsed<()> {
        let active = Mask::read(&mut self.stream, LEAF_VOXELS)?;
        let [mut lowest, mut highest] = [[LEAF_SIDE; 3], [-1; 3]];
        for voxel in active.set() {
            let voxel = voxel as i64;
            for (a, index) in [voxel >> 6, voxel >> 3 & 7, voxel & 7]
                .into_iter()
                .enumerate()
            {
                lowest[a] = lowest[a].min(index);
                highest[a] = highest[a].max(index);
            }
        }
        if active.count() > 0 {
            for corner in [lowest, highest] {
                self.tree
                    .include(std::array::from_fn(|a| low[a] + corner[a]), 1);
            }
        }
        self.tree.leaves += 1;
        Ok(())
    }
}
