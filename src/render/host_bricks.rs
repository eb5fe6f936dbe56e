//! Volume bricks in the host's memory, in the form in which they go to the GPU: what has been read from a file once
//! is not read again while there is room.
//!
//! A brick of a plain file is a thousand short runs of bytes, and a system call for each takes longer than everything
//! else that is done with a brick. So a whole row of bricks is read, slice by slice in one piece each, and those of
//! its bricks that matter are kept for later.

use std::collections::{BTreeSet, HashMap, VecDeque};

use rayon::prelude::*;

use super::brick_layout::BrickLayout;
use crate::error::Result;
use crate::scene::volume::{Region, Volume};

/// Size of the pieces in which rows of bricks are read, approximately.
const ROW_BYTES: usize = 8 << 20;
/// Bricks that are read together where there is no room for all that matter: those not asked for soon would be
/// evicted before they are used.
const FEW_TOGETHER: u32 = 4;

pub struct HostBricks {
    volume: Volume,
    layout: BrickLayout,
    /// For each brick, whether shaders may ask for it, as far as the scene at the beginning tells.
    matters: Vec<bool>,
    /// Bricks that are read together along x.
    together: u32,
    held: HashMap<u32, Vec<u8>>,
    /// The bricks in `held`, oldest first.
    order: VecDeque<u32>,
    bytes: u64,
    most_bytes: u64,
    pub bytes_read: u64,
}

/// A brick's index and its voxels, as read from the volume.
type Read = (u32, Vec<u8>);

impl HostBricks {
    /// Holds at most as many bytes as the layout says. A compressed volume is copied to its store first.
    pub fn new(volume: &Volume, layout: BrickLayout, matters: Vec<bool>) -> Result<HostBricks> {
        let volume = volume.in_any_order()?;
        let all = matters.iter().filter(|&&matters| matters).count();
        let brick_bytes = volume.stored.bytes() * (layout.pitch() as usize).pow(3);
        let all_bytes = (all * brick_bytes) as u64;
        Ok(HostBricks {
            together: match volume.is_in_runs() {
                true if all_bytes <= layout.host_bytes => (ROW_BYTES / brick_bytes).max(1) as u32,
                true => FEW_TOGETHER,
                false => 1,
            },
            volume,
            layout,
            matters,
            held: HashMap::new(),
            order: VecDeque::new(),
            bytes: 0,
            most_bytes: layout.host_bytes,
            bytes_read: 0,
        })
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

    /// Writes each brick into its own chunk of `room` bytes of `rooms`.
    pub fn fill(&mut self, bricks: &[u32], rooms: &mut [u8], room: usize) -> Result<()> {
        let wanted: HashMap<u32, usize> = bricks.iter().copied().zip(0..).collect();
        rooms
            .par_chunks_mut(room)
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
        for rows in rows.chunks(rayon::current_num_threads()) {
            let read = |&row| self.read_row(row, &wanted);
            let read: Vec<Vec<Read>> = rows.par_iter().map(read).collect::<Result<_>>()?;
            for (brick, bytes) in read.into_iter().flatten() {
                if let Some(&n) = wanted.get(&brick) {
                    rooms[n * room..][..bytes.len()].copy_from_slice(&bytes);
                }
                self.keep(brick, bytes);
            }
        }
        Ok(())
    }

    /// Position of the first brick of those that are read together with this one, as z, y, x: in the file's order.
    fn row_of(&self, brick: u32) -> [u32; 3] {
        let [x, y, z] = self.layout.brick(brick);
        [z, y, x - x % self.together]
    }

    /// Reads a row of bricks and returns those that are wanted now or may be later.
    fn read_row(&self, [z, y, x]: [u32; 3], wanted: &HashMap<u32, usize>) -> Result<Vec<Read>> {
        let [width, height, _] = self.layout.bricks;
        let end = (x + self.together).min(width);
        let index = |x: u32| (z * height + y) * width + x;
        let is_of_use = |brick: &u32| {
            let matters = wanted.contains_key(brick) || self.matters[*brick as usize];
            matters && !self.held.contains_key(brick)
        };
        let row = self.region_of([x, y, z], end - x);
        let size = self.volume.stored.bytes();
        let mut voxels = vec![0; row.voxels() * size];
        self.volume.read(row, &mut voxels)?;
        let bricks = (x..end).map(index).filter(is_of_use);
        Ok(bricks
            .map(|brick| (brick, self.cut(brick, row, &voxels)))
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

    fn keep(&mut self, brick: u32, bytes: Vec<u8>) {
        let count = bytes.len() as u64;
        self.bytes_read += count;
        while self.bytes + count > self.most_bytes
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
