//! Work that reads the volume, and passes that begin anew where they have missed a brick of it, in contrast to paths,
//! which wait.

use super::bricks::Admission;
use super::resources::Resources;
use crate::error::Result;
use crate::gpu::{Dispatch, Frame, Recording, SLICE_MS, Slices};

/// Progress of a pass that reads the volume and runs in slices.
#[derive(Debug)]
pub struct ReadingSlices {
    slices: Slices,
    /// The slice has missed bricks, and runs again.
    repeated: Option<Repeated>,
}

/// A slice of which some invocations still have to work.
#[derive(Debug)]
struct Repeated {
    /// The work that the slice is part of (`VolumeBricks::done_mark`).
    mark: u32,
    admission: Admission,
    /// The slices once this one is done.
    behind: Slices,
}

impl ReadingSlices {
    /// Slices that take about `target_ms` milliseconds each.
    pub fn new(target_ms: f64) -> ReadingSlices {
        ReadingSlices {
            slices: Slices::new(target_ms),
            repeated: None,
        }
    }

    /// Starts over with the first slice.
    pub fn restart(&mut self, target_ms: f64) {
        self.slices.restart(target_ms);
        self.repeated = None;
    }
}

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

    /// Runs the next slice of a pass that reads the volume, or the same again where some of its invocations have missed bricks,
    /// which have been brought since; `then` records what follows it in the same submission. Returns whether all slices are
    /// done.
    pub fn run_slice<'r, P: bytemuck::NoUninit>(
        &'r self,
        frame: &mut Frame,
        dispatch: &Dispatch<'r, P>,
        slices: &mut ReadingSlices,
        then: impl FnOnce(&mut Recording<'_, 'r>) -> Result<()>,
    ) -> Result<bool> {
        let now = &mut slices.slices;
        let Some(bricks) = &self.bricks else {
            return frame.run_slice(dispatch, now, |recording, slice| {
                slice(recording)?;
                then(recording)
            });
        };
        // Once other work has begun, it is no longer known which invocations are done.
        let repeated = slices.repeated.take();
        let (mut admission, behind) =
            match repeated.filter(|slice| slice.mark == bricks.done_mark()) {
                Some(slice) => (slice.admission, Some(slice.behind)),
                None => (bricks.begin_pixels(frame)?, None),
            };
        let mut next = *now;
        let is_last = frame.run_slice(dispatch, &mut next, |recording, slice| {
            self.record_reading(recording, &admission, slice)?;
            then(recording)
        })?;
        // Invocations that have missed bricks, or have nothing left to do, take less time than they would.
        let behind = behind.map_or(next, |behind| behind.no_faster_than(&next));
        if bricks.serve(frame, &self.volumes, &mut admission)? {
            *now = now.once_more(&behind);
            slices.repeated = Some(Repeated {
                mark: bricks.done_mark(),
                admission,
                behind,
            });
            return Ok(false);
        }
        *now = behind;
        Ok(is_last)
    }

    /// Works without waiting for bricks: other voxels stand in for those that are missing, of which some are brought afterwards.
    /// All passes of the work must have read the volume by [`run_slice`](Resources::run_slice) or
    /// [`record_reading`](Resources::record_reading).
    pub fn without_waiting<T>(
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
        let ended = bricks.end_preview(frame, &self.volumes);
        done.and_then(|done| ended.map(|()| done))
    }

    /// Runs all slices of a pass that reads the volume.
    pub fn run_in_slices<P: bytemuck::NoUninit>(
        &self,
        frame: &mut Frame,
        dispatch: &Dispatch<'_, P>,
    ) -> Result<()> {
        let mut slices = ReadingSlices::new(SLICE_MS);
        while !self.run_slice(frame, dispatch, &mut slices, |_| Ok(()))? {}
        Ok(())
    }
}
