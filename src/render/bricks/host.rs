//! Volume bricks in the host's memory, in the form in which they go to the GPU: what has been read from a file once
//! is not read again while there is room.
//!
//! A brick of a plain file is a thousand short runs of bytes, and a system call for each takes longer than everything
//! else that is done with a brick. So a whole row of bricks is read, slice by slice in one piece each. Those of its
//! bricks that nobody has asked for, but that are needed, are kept for later as long as there is free room: they do not
//! drive out what was asked for.

use std::collections::{BTreeSet, HashMap, VecDeque};

use rayon::prelude::*;

use crate::error::Result;
use crate::render::layout::BrickLayout;
use crate::scene::volume::{Access, Region, Volume};

/// Bytes of a line of voxels that are read together, at most: to copy so many takes about as long as a system call.
const LINE_BYTES: usize = 8 << 10;
/// Rows of bricks that are read at a time, at most: each needs up to 9 MB.
const ROWS_AT_ONCE: usize = 8;

pub struct HostBricks {
    volume: Volume,
    layout: BrickLayout,
    /// For each brick, whether there was something to see in it at the beginning.
    needed: Vec<bool>,
    /// Bricks that are read together along x.
    together: u32,
    held: HashMap<u32, Vec<u8>>,
    /// The bricks in `held`, oldest first.
    order: VecDeque<u32>,
    bytes: u64,
    most_bytes: u64,
    /// Memory for the rows that are read at a time.
    rows: Vec<Vec<u8>>,
    /// Bytes read from the volume, those between bricks included.
    pub bytes_read: u64,
}

/// A brick's index and its voxels, as read from the volume.
type Read = (u32, Vec<u8>);

impl HostBricks {
    /// Holds at most as many bytes as the layout says. A compressed volume is copied to its store first.
    pub fn new(volume: &Volume, layout: BrickLayout, needed: Vec<bool>) -> Result<HostBricks> {
        let volume = volume.in_any_order()?;
        let line_bytes = layout.side as usize * volume.stored.bytes();
        Ok(HostBricks {
            together: if volume.access() == Access::Rows {
                (LINE_BYTES / line_bytes).max(1) as u32
            } else {
                1
            },
            volume,
            layout,
            needed,
            held: HashMap::new(),
            order: VecDeque::new(),
            bytes: 0,
            most_bytes: layout.host_bytes,
            rows: vec![Vec::new(); rayon::current_num_threads().min(ROWS_AT_ONCE)],
            bytes_read: 0,
        })
    }

    /// Whether bricks in a row along x are read together.
    pub fn reads_rows(&self) -> bool {
        self.together > 1
    }

    /// The voxels of a brick, and the first ones behind it along each axis.
    pub fn region(&self, brick: u32) -> Region {
        self.region_of(self.layout.brick(brick), 1)
    }

    /// The voxels of `count` bricks in a row along x, and the first ones behind them along each axis.
    fn region_of(&self, first: [u32; 3], count: u32) -> Region {
        let low = first.map(|i| i * self.layout.side);
        let dims = self.volume.dims;
        let most = [
            count * self.layout.side + 1,
            self.layout.pitch(),
            self.layout.pitch(),
        ];
        Region {
            low,
            dims: std::array::from_fn(|a| most[a].min(dims[a] - low[a])),
        }
    }

    /// Writes each brick into its own chunk of `brick_stride` bytes of `staged`.
    pub fn fill(&mut self, bricks: &[u32], staged: &mut [u8], brick_stride: usize) -> Result<()> {
        let wanted: HashMap<u32, usize> = bricks.iter().copied().zip(0..).collect();
        staged
            .par_chunks_mut(brick_stride)
            .zip(bricks)
            .for_each(|(bytes, brick)| {
                if let Some(held) = self.held.get(brick) {
                    bytes[..held.len()].copy_from_slice(held);
                }
            });
        let missing = bricks
            .iter()
            .filter(|&brick| !self.held.contains_key(brick));
        let rows: BTreeSet<[u32; 3]> = missing.map(|&brick| self.row_of(brick)).collect();
        let rows: Vec<_> = rows.into_iter().collect();
        let mut memory = std::mem::take(&mut self.rows);
        let read = rows.chunks(memory.len()).try_for_each(|rows| {
            let memory = &mut memory[..rows.len()];
            self.fill_from(rows, memory, &wanted, staged, brick_stride)
        });
        self.rows = memory;
        read
    }

    /// Reads rows of bricks, each into memory of its own, and copies those that are wanted to their chunks.
    fn fill_from(
        &mut self,
        rows: &[[u32; 3]],
        memory: &mut [Vec<u8>],
        wanted: &HashMap<u32, usize>,
        staged: &mut [u8],
        brick_stride: usize,
    ) -> Result<()> {
        let read = |(&row, voxels)| self.read_row(row, wanted, voxels);
        let read = rows.par_iter().zip(&mut *memory).map(read);
        let read: Vec<Vec<Read>> = read.collect::<Result<_>>()?;
        self.bytes_read += memory.iter().map(|row| row.len() as u64).sum::<u64>();
        for (brick, bytes) in read.into_iter().flatten() {
            let index = wanted.get(&brick);
            if let Some(&n) = index {
                staged[n * brick_stride..][..bytes.len()].copy_from_slice(&bytes);
            }
            self.keep(brick, bytes, index.is_some());
        }
        Ok(())
    }

    /// Position of the first brick of those that are read together with this one, as z, y, x: in the file's order.
    fn row_of(&self, brick: u32) -> [u32; 3] {
        let [x, y, z] = self.layout.brick(brick);
        [z, y, x - x % self.together]
    }

    /// Reads a row of bricks into `voxels` and returns those that are wanted now or may be later.
    fn read_row(
        &self,
        [z, y, x]: [u32; 3],
        wanted: &HashMap<u32, usize>,
        voxels: &mut Vec<u8>,
    ) -> Result<Vec<Read>> {
        let [width, height, _] = self.layout.bricks;
        let end = (x + self.together).min(width);
        let index = |x: u32| (z * height + y) * width + x;
        let brick_bytes = self.layout.brick_bytes(self.volume.stored.bytes());
        let has_room = self.bytes + brick_bytes <= self.most_bytes;
        let is_of_use = |brick: &u32| {
            let needed = has_room && self.needed[*brick as usize];
            (needed || wanted.contains_key(brick)) && !self.held.contains_key(brick)
        };
        let row = self.region_of([x, y, z], end - x);
        let size = self.volume.stored.bytes();
        voxels.resize(row.voxels() * size, 0);
        self.volume.read(row, voxels)?;
        let bricks = (x..end).map(index).filter(is_of_use);
        Ok(bricks
            .map(|brick| (brick, self.cut(brick, row, voxels)))
            .collect())
    }

    /// Copies one brick out of a row of bricks.
    fn cut(&self, brick: u32, row: Region, voxels: &[u8]) -> Vec<u8> {
        let region = self.region(brick);
        let size = self.volume.stored.bytes();
        let begin = (region.low[0] - row.low[0]) as usize * size;
        let length = region.dims[0] as usize * size;
        let lines = voxels.chunks_exact(row.dims[0] as usize * size);
        let mut bytes = Vec::with_capacity(region.voxels() * size);
        lines.for_each(|line| bytes.extend_from_slice(&line[begin..begin + length]));
        bytes
    }

    /// Keeps a brick: one that was asked for in the place of the oldest ones, another one only if there is free room.
    fn keep(&mut self, brick: u32, bytes: Vec<u8>, is_wanted: bool) {
        let count = bytes.len() as u64;
        while is_wanted
            && self.bytes + count > self.most_bytes
            && let Some(oldest) = self.order.pop_front()
        {
            let gone = self.held.remove(&oldest).unwrap_or_default();
            self.bytes -= gone.len() as u64;
        }
        if self.bytes + count <= self.most_bytes {
            self.bytes += count;
            self.order.push_back(brick);
            self.held.insert(brick, bytes);
        }
    }
}
