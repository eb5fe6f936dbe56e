//! What host and shaders exchange around a dispatch that reads a volume in bricks: before it, where bricks are and which
//! invocations may work; after it, which bricks were read or asked for, and what came of the work.

use std::sync::Arc;

use bytemuck::Zeroable;

use super::admission::{Admission, Items};
use crate::error::Result;
use crate::gpu::{Buffer, BufferDesc, Memory, Recording};
use crate::render::layout::BrickLayout;
use crate::render::shared::Streaming;

/// The buffers that shaders read and write.
pub struct DeviceSide {
    /// A word for each brick (`places.rs`).
    pub pages: Buffer,
    pub streaming: Buffer,
}

/// The host's copies of these.
pub struct HostSide {
    pages: Buffer,
    streaming: Buffer,
}

/// What the next dispatch will be told, and what the last one has reported.
pub struct Exchange {
    /// Whether the host's page table has changes that the device does not know yet.
    pages_changed: bool,
    pub items: Items,
    /// Whether invocations do without missing bricks instead of waiting for them.
    pub previews: bool,
    /// The value that a pixel or a brick of the cache gets in `done` once it is done in the work under way; 0 before any
    /// work.
    pub done_mark: u32,
    /// What the last dispatch has reported.
    pub report: Streaming,
}

impl DeviceSide {
    pub fn allocate(memory: &Arc<Memory>, layout: &BrickLayout) -> Result<DeviceSide> {
        let buffer = |name, bytes| Buffer::new(memory, BufferDesc::device(name, bytes));
        Ok(DeviceSide {
            pages: buffer("volume pages", page_bytes(layout))?,
            streaming: buffer("streaming", size_of::<Streaming>() as u64)?,
        })
    }
}

impl HostSide {
    pub fn allocate(memory: &Arc<Memory>, layout: &BrickLayout) -> Result<HostSide> {
        let buffer = |name, bytes| Buffer::new(memory, BufferDesc::host_cached(name, bytes));
        Ok(HostSide {
            pages: buffer("volume pages, host", page_bytes(layout))?,
            streaming: buffer("streaming, host", size_of::<Streaming>() as u64)?,
        })
    }

    /// The page table as the last dispatch has left it.
    pub fn pages(&self, layout: &BrickLayout) -> Vec<u32> {
        self.pages.read_vec(layout.total() as usize)
    }

    /// Records the copies of a dispatch's report.
    pub fn record_report<'r>(
        &'r self,
        recording: &mut Recording<'_, 'r>,
        device: &'r DeviceSide,
    ) -> Result<()> {
        recording.copy(&device.streaming, &self.streaming)?;
        recording.copy(&device.pages, &self.pages)
    }
}

impl Exchange {
    pub fn new() -> Exchange {
        Exchange {
            pages_changed: false,
            items: Items::NONE,
            previews: false,
            done_mark: 0,
            report: Streaming::zeroed(),
        }
    }

    /// Starts a new piece of work on pixels or on bricks of the cache, and chooses its mark in `done`. Returns true if the
    /// count of marks starts over: at first, after `forget_marks`, or when it has wrapped around. The caller must then clear
    /// the `done` buffer, since an old mark could equal the new one.
    pub fn begin(&mut self) -> bool {
        self.done_mark = self.done_mark.wrapping_add(1);
        let begins_anew = self.done_mark <= 1;
        self.done_mark = self.done_mark.max(1);
        begins_anew
    }

    /// To be called before the `done` buffer is resized: the next `begin` then has it cleared.
    pub fn forget_marks(&mut self) {
        self.done_mark = 0;
    }

    /// Prepares the page table of the next dispatch.
    pub fn write_pages(&mut self, host: &HostSide, pages: &[u32]) {
        host.pages.write(pages);
        self.pages_changed = true;
    }

    fn state(&self, admission: &Admission) -> Streaming {
        Streaming {
            first_missed: u32::MAX,
            first: admission.first,
            count: admission.count,
            done_mark: self.done_mark,
            units: self.items.units,
            first_item: self.items.first,
            end_item: self.items.end,
            oldest_item: u32::MAX,
            previews: self.previews as u32,
            ..Streaming::zeroed()
        }
    }

    /// Records the copies that tell a dispatch where bricks are and which invocations are admitted.
    pub fn record_state<'r>(
        &mut self,
        recording: &mut Recording<'_, 'r>,
        host: &'r HostSide,
        device: &'r DeviceSide,
        admission: &Admission,
    ) -> Result<()> {
        host.streaming.write(&[self.state(admission)]);
        if std::mem::take(&mut self.pages_changed) {
            recording.copy(&host.pages, &device.pages)?;
        }
        recording.copy(&host.streaming, &device.streaming)
    }

    /// Reads the report that has been copied.
    pub fn read_report(&mut self, host: &HostSide) {
        self.report = host.streaming.read();
    }
}

fn page_bytes(layout: &BrickLayout) -> u64 {
    4 * u64::from(layout.total())
}
