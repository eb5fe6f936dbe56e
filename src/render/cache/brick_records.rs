//! A record for each brick of the cache that has memory, in order of their places. The host writes which nodes a batch fills,
//! and passes read it for each path; a march weighs the bricks, and the host reads that.
//!
//! On a GPU, these reads and atomic additions would each cross the bus: passes there work on a copy in the device's memory,
//! which is brought up to date before they read and fetched after they have written. A CPU needs no copy.

use std::sync::Arc;

use bytemuck::Zeroable;

use crate::error::Result;
use crate::gpu::{Binding, Buffer, BufferDesc, Frame, Memory};
use crate::render::layout::CacheLayout;
use crate::render::resources::bytes_of;
use crate::render::shared::Brick;

pub struct BrickRecords {
    host: Buffer,
    /// `None` where passes use `host` itself.
    device: Option<Buffer>,
}

impl BrickRecords {
    /// A dry run only counts the records: a plan looks at several layouts.
    pub fn allocate(memory: &Arc<Memory>, layout: &CacheLayout) -> Result<BrickRecords> {
        let bytes = bytes_of::<Brick>(layout.active.len().max(1) as u32);
        let mut host = Buffer::new(memory, BufferDesc::host_cached("cache: bricks", bytes))?;
        if host.mapped_mut().is_some() {
            host.write(&records(layout));
        }
        let is_copied = !memory.device().loads_texels;
        let device = || Buffer::new(memory, BufferDesc::device("cache: bricks, copy", bytes));
        Ok(BrickRecords {
            host,
            device: is_copied.then(device).transpose()?,
        })
    }

    /// Takes the bricks of another layout.
    pub fn lay_out(&mut self, layout: &CacheLayout) -> Result<()> {
        self.host.rewrite(&records(layout))?;
        match &mut self.device {
            Some(device) => device.resize(self.host.desc().bytes),
            None => Ok(()),
        }
    }

    pub fn binding(&self) -> Binding<'_> {
        Binding::Buffer(self.device.as_ref().unwrap_or(&self.host))
    }

    pub fn bytes(&self) -> u64 {
        let copy = self.device.as_ref();
        self.host.desc().bytes + copy.map_or(0, |device| device.desc().bytes)
    }

    /// The records of the first `count` places. What is written into them reaches passes after an [`upload`](BrickRecords::upload).
    pub fn records_mut(&mut self, count: usize) -> &mut [Brick] {
        let room = self.host.mapped_mut().unwrap_or_default();
        let bytes = (count * size_of::<Brick>()).min(room.len());
        bytemuck::cast_slice_mut(&mut room[..bytes])
    }

    /// Gives passes the host's records.
    pub fn upload(&self, frame: &mut Frame) -> Result<()> {
        match &self.device {
            Some(device) => frame.run(|recording| recording.copy(&self.host, device)),
            None => Ok(()),
        }
    }

    /// Gives the host what passes have written.
    pub fn download(&self, frame: &mut Frame) -> Result<()> {
        match &self.device {
            Some(device) => frame.run(|recording| recording.copy(device, &self.host)),
            None => Ok(()),
        }
    }
}

/// None of the nodes has had a path.
fn records(layout: &CacheLayout) -> Vec<Brick> {
    let brick = |&position: &u32| Brick {
        position,
        ..Brick::zeroed()
    };
    layout.active.iter().map(brick).collect()
}
