//! A grid's tree: the root's blocks of 4096³ voxels, their upper nodes with 32³ slots of 128³ voxels, lower nodes with
//! 16³ slots of 8³ voxels, and leaves with 8³ voxels (`openvdb/tree`). A slot holds a node, or one value for all of its
//! voxels. In every array z is the fastest index.

use std::collections::BTreeMap;

use super::archive::Grid;
use super::mask::Mask;
use super::packed::Packed;
use super::stream::{BLOCK, Stream};
use crate::scene::volume::parsed::Parsed;
use crate::scene::volume::source::watched::WatchedFile;

/// A level of nodes above the leaves.
struct Level {
    /// Binary logarithm of the slots along each axis.
    log2: u32,
    /// Voxels of a slot along each axis.
    slot: i64,
}

const UPPER: Level = Level { log2: 5, slot: 128 };
const LOWER: Level = Level { log2: 4, slot: 8 };
/// Voxels along each axis of a root's block and of a leaf.
const BLOCK_SIDE: i64 = 4096;
pub const LEAF_SIDE: i64 = 8;
pub const LEAF_VOXELS: usize = 512;

impl Level {
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
        let [x, y, z] = voxel.map(|index| (index / self.slot) as usize & mask);
        (x << self.log2 | y) << self.log2 | z
    }
}

/// A slot's entry that is no child.
const NO_CHILD: u32 = u32::MAX;

#[derive(Debug)]
struct Node {
    /// The number of each slot's child, or [`NO_CHILD`].
    children: Vec<u32>,
    /// The value of each slot.
    values: Vec<u8>,
}

/// A leaf's mask and values, as bytes of the file.
#[derive(Debug, Clone, Copy)]
pub struct Leaf {
    pub at: u64,
    pub bytes: u32,
}

#[derive(Debug)]
enum Entry {
    Node(u32),
    Value(Vec<u8>),
}

#[derive(Debug)]
pub struct Tree {
    pub background: Vec<u8>,
    /// The root's blocks, by their lowest voxel.
    blocks: BTreeMap<[i64; 3], Entry>,
    upper: Vec<Node>,
    lower: Vec<Node>,
    leaves: Vec<Leaf>,
    /// The lowest active voxel along each axis, and one more than the highest.
    active: [[i64; 3]; 2],
}

/// What holds the value of a voxel.
pub enum Found<'a> {
    Leaf(Leaf),
    /// All voxels of the leaf that could be here have this value.
    Value(&'a [u8]),
}

impl Tree {
    pub fn read(file: &WatchedFile, grid: &Grid) -> Parsed<Tree> {
        let mut stream = Stream::new(file, grid.nodes, BLOCK);
        // Buffers of a tree, of which there has been no more than one for long.
        stream.skip(4);
        let alone = grid.number.bytes_alone() as u64;
        let background = grid.number.alone(stream.bytes(alone)?);
        let mut reading = Reading {
            stream,
            grid,
            tree: Tree {
                background,
                blocks: BTreeMap::new(),
                upper: Vec::new(),
                lower: Vec::new(),
                leaves: Vec::new(),
                active: [[i64::MAX; 3], [i64::MIN; 3]],
            },
        };
        reading.blocks()?;
        reading.leaves()?;
        Ok(reading.tree)
    }

    /// The lowest active voxel.
    pub fn low(&self) -> [i64; 3] {
        self.active[0]
    }

    /// The size of the box of active voxels.
    pub fn dims(&self) -> Parsed<[u32; 3]> {
        let [low, high] = self.active;
        if low[0] > high[0] {
            return Err("has no active voxel".into());
        }
        let mut dims = [0; 3];
        for a in 0..3 {
            let size = high[a] - low[a];
            dims[a] = u32::try_from(size).map_err(|_| format!("is {size} voxels long"))?;
        }
        Ok(dims)
    }

    /// What holds the values of a leaf's place, of which `voxel` is one.
    pub fn find(&self, voxel: [i64; 3]) -> Found<'_> {
        let block = voxel.map(|index| index.div_euclid(BLOCK_SIDE) * BLOCK_SIDE);
        let upper = match self.blocks.get(&block) {
            None => return Found::Value(&self.background),
            Some(Entry::Value(value)) => return Found::Value(value),
            Some(Entry::Node(upper)) => &self.upper[*upper as usize],
        };
        let inside: [i64; 3] = std::array::from_fn(|a| voxel[a] - block[a]);
        let lower = match upper.slot(UPPER.slot_of(inside), self.background.len()) {
            Err(value) => return Found::Value(value),
            Ok(lower) => &self.lower[lower],
        };
        match lower.slot(LOWER.slot_of(inside), self.background.len()) {
            Err(value) => Found::Value(value),
            Ok(leaf) => Found::Leaf(self.leaves[leaf]),
        }
    }

    fn include(&mut self, low: [i64; 3], side: i64) {
        let [lowest, highest] = &mut self.active;
        for a in 0..3 {
            lowest[a] = lowest[a].min(low[a]);
            highest[a] = highest[a].max(low[a] + side);
        }
    }
}

impl Node {
    /// A slot's child, or else its value.
    fn slot(&self, slot: usize, bytes: usize) -> Result<usize, &[u8]> {
        match self.children[slot] {
            NO_CHILD => Err(&self.values[slot * bytes..][..bytes]),
            child => Ok(child as usize),
        }
    }
}

/// A tree of which a part has been read.
struct Reading<'a> {
    stream: Stream<'a>,
    grid: &'a Grid,
    tree: Tree,
}

impl Reading<'_> {
    fn blocks(&mut self) -> Parsed<()> {
        let (values, nodes) = (self.stream.u32()?, self.stream.u32()?);
        let alone = self.grid.number.bytes_alone() as u64;
        for _ in 0..values {
            let low = self.stream.place()?;
            let value = self.grid.number.alone(self.stream.bytes(alone)?);
            if self.stream.u8()? != 0 {
                self.tree.include(low, BLOCK_SIDE);
            }
            self.put(low, Entry::Value(value))?;
        }
        let mut last = None;
        for _ in 0..nodes {
            let low = self.stream.place()?;
            // Leaves lie in this order in the file.
            if last.replace(low).is_some_and(|last| last >= low) {
                return Err("has blocks in another order than theirs: the file is damaged".into());
            }
            let upper = self.node(&UPPER, low)?;
            self.tree.upper.push(upper);
            self.put(low, Entry::Node(self.tree.upper.len() as u32 - 1))?;
        }
        Ok(())
    }

    fn put(&mut self, low: [i64; 3], entry: Entry) -> Parsed<()> {
        let is_block = low.iter().all(|index| index.rem_euclid(BLOCK_SIDE) == 0);
        match is_block && self.tree.blocks.insert(low, entry).is_none() {
            true => Ok(()),
            false => Err(format!(
                "has a block at {low:?}, expected multiples of {BLOCK_SIDE}, each once: the file is damaged"
            )),
        }
    }

    /// A node, whose children are put into the tree.
    fn node(&mut self, level: &Level, low: [i64; 3]) -> Parsed<Node> {
        let slots = level.slots();
        let children = Mask::read(&mut self.stream, slots)?;
        let active = Mask::read(&mut self.stream, slots)?;
        let grid = self.grid;
        let packed = Packed::read(
            &mut self.stream,
            grid.number,
            grid.compression,
            &self.tree.background,
            &active,
        )?;
        let mut node = Node {
            children: vec![NO_CHILD; slots],
            values: packed.unpack(&mut self.stream)?,
        };
        for slot in active.set() {
            self.tree.include(level.low(low, slot), level.slot);
        }
        for slot in children.set() {
            let low = level.low(low, slot);
            let is_above_leaves = level.slot == LEAF_SIDE;
            node.children[slot] = match is_above_leaves {
                true => self.leaf(low)?,
                false => {
                    let lower = self.node(&LOWER, low)?;
                    self.tree.lower.push(lower);
                    self.tree.lower.len() as u32 - 1
                }
            };
        }
        Ok(node)
    }

    /// A leaf's mask. Its values stand elsewhere.
    fn leaf(&mut self, low: [i64; 3]) -> Parsed<u32> {
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
        self.tree.leaves.push(Leaf { at: 0, bytes: 0 });
        Ok(self.tree.leaves.len() as u32 - 1)
    }

    /// Finds out where each leaf's values are.
    fn leaves(&mut self) -> Parsed<()> {
        self.stream.seek(self.grid.leaves);
        for leaf in &mut self.tree.leaves {
            leaf.at = self.stream.at();
            let mask = Mask::read(&mut self.stream, LEAF_VOXELS)?;
            let grid = self.grid;
            let packed = Packed::read(
                &mut self.stream,
                grid.number,
                grid.compression,
                &self.tree.background,
                &mask,
            )?;
            packed.skip(&mut self.stream)?;
            leaf.bytes = u32::try_from(self.stream.at() - leaf.at)
                .map_err(|_| "has a leaf beyond 4 GiB: the file is damaged")?;
        }
        Ok(())
    }
}
