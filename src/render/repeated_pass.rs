//! Passes that read the volume and begin anew where they have missed a brick of it, in contrast to paths, which wait.

use super::bricks::Order;
use super::resources::Resources;
use crate::error::Result;
use crate::gpu::{Binding, Frame, Pass, SLICE_MS, Slices};

impl Resources {
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
        let before = *slices;
        frame.run(|f| bricks.record_news(f))?;
        let is_last = frame.run_slice(pass, bindings, push, threads, slices)?;
        frame.run(|f| bricks.record_told(f))?;
        while bricks.serve(frame, &self.volume)? {
            frame.run(|f| bricks.record_news(f))?;
            frame.run_slice(pass, bindings, push, threads, &mut before.clone())?;
            frame.run(|f| bricks.record_told(f))?;
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
