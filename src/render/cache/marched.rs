//! The lookups of the volume that marches make: only the device can count them.
//!
//! A pass that marches adds them to a counter on the device, which the host reads and resets: for `ray_march`, which runs
//! rarely, after each slice; for `camera_march`, which runs for every sample, when the picture is read.

use std::sync::Arc;

use crate::error::Result;
use crate::gpu::{Binding, Buffer, BufferDesc, Frame, Memory, Recording, Work};
use crate::render::resources::bytes_of;
use crate::render::shared::Marched;

pub struct MarchedLookups {
    count: Buffer,
}

impl MarchedLookups {
    pub(super) fn allocate(memory: &Arc<Memory>, name: &'static str) -> Result<MarchedLookups> {
        let desc = BufferDesc::device(name, bytes_of::<Marched>(1));
        let count = Buffer::new(memory, desc)?;
        Ok(MarchedLookups { count })
    }

    /// The resource to which marches add.
    pub fn binding(&self) -> (&'static str, Binding<'_>) {
        ("marched", Binding::Buffer(&self.count))
    }

    /// Begins a new count.
    pub fn begin<'r>(&'r self, recording: &mut Recording<'_, 'r>) -> Result<()> {
        recording.zero(&self.count)
    }

    /// States the count as work of the runs of `pass` since the last count, and begins a new one.
    pub fn collect(&self, frame: &mut Frame, staging: &Buffer, pass: &'static str) -> Result<()> {
        frame.run(|recording| self.record_collection(recording, staging))?;
        self.state_collected(frame, staging, pass);
        Ok(())
    }

    /// The part of [`collect`](MarchedLookups::collect) that the device does.
    pub fn record_collection<'r>(
        &'r self,
        recording: &mut Recording<'_, 'r>,
        staging: &'r Buffer,
    ) -> Result<()> {
        recording.copy(&self.count, staging)?;
        self.begin(recording)
    }

    /// The part of [`collect`](MarchedLookups::collect) that follows.
    pub fn state_collected(&self, frame: &mut Frame, staging: &Buffer, pass: &'static str) {
        let Marched { low, high } = staging.read();
        let lookups = u64::from(high) << 32 | u64::from(low);
        frame.timings.state_work(pass, Work::samples(lookups));
    }
}
