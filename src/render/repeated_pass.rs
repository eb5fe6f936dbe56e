//! Work that reads the volume, and passes that begin anew where they have missed a brick of it, in contrast to paths,
//! which wait.

use super::bricks::Order;
use super::resources::Resources;
use crate::error::Result;
use crate::gpu::{Binding, Frame, Pass, SLICE_MS, Slices};

impl Resources {
    /// Records work that reads the volume. Where that is in bricks, it is told before which of them are there, and reports
    /// afterwards which it has missed.
    pub fn record_reading(
        &self,
        frame: &mut Frame,
        work: impl FnOnce(&mut Frame) -> Result<()>,
    ) -> Result<()> {
        let Some(bricks) = &self.bricks else {
            return work(frame);
        };
        bricks.record_state(frame)?;
        work(frame)?;
        bricks.record_report(frame)
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
        bricks.begin(frame, Order::Pixels)?;
        let try_once = |frame: &mut Frame, slices: &mut Slices| -> Result<bool> {
            frame.run(|f| bricks.record_state(f))?;
            let is_last = frame.run_slice(pass, bindings, push, threads, slices)?;
            frame.run(|f| bricks.record_report(f))?;
            Ok(is_last)
        };
        let before = *slices;
        let is_last = try_once(frame, slices)?;
        while bricks.serve(frame, &self.volume)? {
            try_once(frame, &mut before.clone())?;
        }
        Ok(is_last)
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
