//! Bricks in the host's memory, as they go to the GPU: what has been read from a file once is not read again while there
//! is room.

use std::collections::{HashMap, VecDeque};

use rayon::prelude::*;

use super::brick_layout::BrickLayout;
use crate::error::Result;
use crate::scene::volume::{Region, Volume};

pub struct HostBricks {
    volume: Volume,
    layout: BrickLayout,
    held: HashMap<u32, Vec<u8>>,
    /// In the order in which they came.
    order: VecDeque<u32>,
    bytes: u64,
    most_bytes: u64,
    pub bytes_read: u64,
}

impl HostBricks {
    /// Holds at most `most_bytes`. A volume that is compressed is copied to its store first.
    pub fn new(volume: &Volume, layout: BrickLayout, most_bytes: u64) -> Result<HostBricks> {
        Ok(HostBricks {
            volume: volume.in_any_order()?,
            layout,
            held: HashMap::new(),
            order: VecDeque::new(),
            bytes: 0,
            most_bytes,
            bytes_read: 0,
        })
    }

    /// The voxels of a brick, and those behind it.
    pub fn region(&self, brick: u32) -> Region {
        let low = self.layout.brick(brick).map(|i| i * self.layout.side);
        let dims = self.volume.dims;
        Region {
            low,
            dims: std::array::from_fn(|a| self.layout.pitch().min(dims[a] - low[a])),
        }
    }

    /// Fills a room in `rooms`, each of `room` bytes, with each brick.
    pub fn fill(&mut self, bricks: &[u32], rooms: &mut [u8], room: usize) -> Result<()> {
        let size = self.volume.stored.bytes();
        let found: Vec<bool> = rooms
            .par_chunks_mut(room)
            .zip(bricks)
            .map(|(bytes, brick)| {
                let region = self.region(*brick);
                let bytes = &mut bytes[..region.voxels() * size];
                match self.held.get(brick) {
                    Some(held) => bytes.copy_from_slice(held),
                    None => self.volume.read(region, bytes)?,
                }
                Ok(self.held.contains_key(brick))
            })
            .collect::<Result<_>>()?;
        for ((bytes, &brick), was_held) in rooms.chunks(room).zip(bricks).zip(found) {
            if !was_held {
                let bytes = &bytes[..self.region(brick).voxels() * size];
                self.bytes_read += bytes.len() as u64;
                self.keep(brick, bytes);
            }
        }
        Ok(())
    }

    fn keep(&mut self, brick: u32, bytes: &[u8]) {
        let count = bytes.len() as u64;
        while self.bytes + count > self.most_bytes
            && let Some(oldest) = self.order.pop_front()
        {
            let gone = self.held.remove(&oldest).unwrap_or_default();
            self.bytes -= gone.len() as u64;
        }
        if self.bytes + count <= self.most_bytes {
            self.bytes += count;
            self.order.push_back(brick);
            self.held.insert(brick, bytes.to_vec());
        }
    }
}
