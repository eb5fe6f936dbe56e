//! Work that reads the volume, and passes that begin anew where they have missed a brick of it, in contrast to paths,
//! which wait.

use super::bricks::Admission;
use super::resources::Resources;
use crate::error::Result;
use crate::gpu::{Binding, Frame, Pass, Recording, SLICE_MS, Slices};

impl Resources {
    /// Records work that reads the volume. Where that is in bricks, it is told before which of them are there and who may
    /// work, and reports afterwards which it has missed.
    pub fn record_reading<'r>(
        &'r self,
        recording: &mut Recording<'_, 'r>,
        admission: &Admission,
        work: impl FnOnce(&mut Recording<'_, 'r>) -> Result<()>,
    ) -> Result<()> {
        let Some(bricks) = &self.bricks else {
            return work(recording);
        };
        bricks.record_state(recording, admission)?;
        work(recording)?;
        bricks.record_report(recording)
    }

    /// Runs the next slice of a pass that reads the volume: again and again, until none of its invocations has missed
    /// a brick. Returns whether it was the last slice.
    pub fn run_slice<P: bytemuck::NoUninit>(
        &self,
        frame: &mut Frame,
        pass: &Pass,
        bindings: &[(&str, Binding<'_>)],
        push: &P,
        threads: [u32; 3],
        slices: &mut Slices,
    ) -> Result<bool> {
        let Some(bricks) = &self.bricks else {
            return frame.run_slice(pass, bindings, push, threads, slices);
        };
        let mut admission = bricks.begin_pixels(frame)?;
        let try_once = |frame: &mut Frame, admission: &_, slices: &mut _| -> Result<bool> {
            frame.run(|recording| bricks.record_state(recording, admission))?;
            let is_last = frame.run_slice(pass, bindings, push, threads, slices)?;
            frame.run(|recording| bricks.record_report(recording))?;
            Ok(is_last)
        };
        let before = *slices;
        let is_last = try_once(frame, &admission, slices)?;
        while bricks.serve(frame, &self.volume, &mut admission)? {
            try_once(frame, &admission, &mut before.clone())?;
        }
        Ok(is_last)
    }

    /// Works without waiting for bricks: other voxels stand in for those that are missing, of which some are brought afterwards.
    /// All passes of the work must have read the volume by [`run_slice`](Resources::run_slice) or
    /// [`record_reading`](Resources::record_reading).
    pub fn preview<T>(
        &self,
        frame: &mut Frame,
        work: impl FnOnce(&mut Frame) -> Result<T>,
    ) -> Result<T> {
        let Some(bricks) = &self.bricks else {
            return work(frame);
        };
        bricks.begin_preview();
        let done = work(frame);
        // Whatever has failed, other work waits for its bricks.
        let ended = bricks.end_preview(frame, &self.volume);
        done.and_then(|done| ended.map(|()| done))
    }

    /// Runs all slices of a pass that reads the volume.
    pub fn run_in_slices<P: bytemuck::NoUninit>(
        &self,
        frame: &mut Frame,
        pass: &Pass,
        bindings: &[(&str, Binding<'_>)],
        push: &P,
        threads: [u32; 3],
    ) -> Result<()> {
        let mut slices = Slices::new(SLICE_MS);
        while !self.run_slice(frame, pass, bindings, push, threads, &mut slices)? {}
        Ok(())
    }
}
