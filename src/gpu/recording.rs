//! A command buffer while it is recorded, which is only inside of [`Frame::run`]; `dispatch.rs`, `transfer.rs` and, for a
//! window, `window/` have the commands.
//!
//! Recording a command gives it its barrier, its label and its timestamps. Barriers are global and sit in front of
//! every command, because images stay in one layout and passes run one after another.
//!
//! **Why it is sound.** A command buffer holds handles, which keep nothing alive: the device uses a buffer, an image or a
//! pipeline long after the call that has recorded it. So each command borrows what it uses for `'r`, a lifetime that the
//! caller of `run` chooses and that, like any lifetime of a function's signature, lasts until `run` has returned. `run` waits
//! for the device before it returns. The compiler therefore refuses to drop, to resize or to map anything that is recorded
//! until the device has finished with it, and nothing has to be counted.
//!
//! `'f` is the borrow of the frame. `run` demands a closure that takes a recording of any `'f`, so that no recording can be
//! kept or exchanged for that of another frame. A frame that is recorded cannot run or be recorded once more, since the
//! recording borrows it. If the closure panics, the command buffer stays half recorded, and the next `run` resets it.

use ash::vk;

use super::frame::{CommandKind, Frame, MOST_COMMANDS, Recorded};
use super::image::Image;
use super::timing::Work;
use crate::error::{DeviceError, Error, Result};

/// The commands of one submission, and what they use.
///
/// What is recorded can be dropped once its work has ended, and not before:
///
/// ```no_run
/// # use isolume::{error::Result, gpu::{Buffer, Frame}};
/// fn dropped(frame: &mut Frame, buffer: Buffer) -> Result<()> {
///     frame.run(|recording| {
///         recording.zero(&buffer)?;
///         Ok(())
///     })?;
///     drop(buffer);
///     Ok(())
/// }
/// ```
///
/// ```compile_fail,E0505
/// # use isolume::{error::Result, gpu::{Buffer, Frame}};
/// fn dropped(frame: &mut Frame, buffer: Buffer) -> Result<()> {
///     frame.run(|recording| {
///         recording.zero(&buffer)?;
///         drop(buffer);
///         Ok(())
///     })
/// }
/// ```
///
/// The host sees memory after the device has changed it, and not meanwhile:
///
/// ```no_run
/// # use isolume::{error::Result, gpu::{Buffer, Frame}};
/// fn seen(frame: &mut Frame, buffer: &mut Buffer) -> Result<bool> {
///     frame.run(|recording| recording.zero(buffer))?;
///     let mapped = buffer.mapped_mut();
///     Ok(mapped.is_some())
/// }
/// ```
///
/// ```compile_fail,E0502
/// # use isolume::{error::Result, gpu::{Buffer, Frame}};
/// fn seen(frame: &mut Frame, buffer: &mut Buffer) -> Result<bool> {
///     let mapped = buffer.mapped_mut();
///     frame.run(|recording| recording.zero(buffer))?;
///     Ok(mapped.is_some())
/// }
/// ```
pub struct Recording<'f, 'r> {
    pub(super) frame: &'f mut Frame,
    /// The images that the submission begins.
    pub(super) begun: Vec<&'r Image>,
}

impl Frame {
    /// Records, submits and waits. An error while recording submits nothing. The resources that are recorded are borrowed
    /// for `'r`, which lasts until this has returned, and with it the device's work on them.
    pub fn run<'r>(
        &mut self,
        record: impl FnOnce(&mut Recording<'_, 'r>) -> Result<()>,
    ) -> Result<()> {
        let mut recording = Recording::begin(self)?;
        record(&mut recording)?;
        let begun = recording
            .end()
            .and_then(|begun| self.submit().map(|()| begun))
            .map_err(|e| self.failed_in(self.main(), e))?;
        begun.iter().for_each(|image| image.note_begun());
        Ok(())
    }
}

impl<'f, 'r> Recording<'f, 'r> {
    fn begin(frame: &'f mut Frame) -> Result<Recording<'f, 'r>> {
        frame.recorded.clear();
        reset(frame).map_err(|e| frame.failed(e))?;
        Ok(Recording {
            frame,
            begun: Vec::new(),
        })
    }

    /// Ends the recording, for its submission. Returns the images that it begins.
    fn end(self) -> Result<Vec<&'r Image>, vk::Result> {
        self.barrier(vk::PipelineStageFlags2::HOST, vk::AccessFlags2::HOST_READ);
        let (raw, commands) = self.raw();
        // SAFETY: recording has begun, and ends here.
        unsafe { raw.end_command_buffer(commands) }?;
        Ok(self.begun)
    }

    /// What records a command, and where.
    pub(super) fn raw(&self) -> (&ash::Device, vk::CommandBuffer) {
        (&self.frame.device.raw, self.frame.commands)
    }

    /// An error while recording, naming the last command.
    pub(super) fn failed(&self, error: vk::Result) -> Error {
        self.frame.failed(error)
    }

    /// Makes the effects of everything before visible to the commands that follow at `stage`. A test leaves barriers
    /// out, to see that validation reports them.
    fn barrier(&self, stage: vk::PipelineStageFlags2, access: vk::AccessFlags2) {
        if self.frame.leave_out_barriers {
            return;
        }
        let (raw, commands) = self.raw();
        let barriers = [vk::MemoryBarrier2::default()
            .src_stage_mask(self.frame.device.work_stages)
            .src_access_mask(vk::AccessFlags2::MEMORY_WRITE | vk::AccessFlags2::MEMORY_READ)
            .dst_stage_mask(stage)
            .dst_access_mask(access)];
        let info = vk::DependencyInfo::default().memory_barriers(&barriers);
        // SAFETY: the command buffer is recording.
        unsafe { raw.cmd_pipeline_barrier2(commands, &info) };
    }

    /// Records a command with its barrier, label and timestamps.
    pub(super) fn record_command(
        &mut self,
        name: &'static str,
        kind: CommandKind,
        stage: vk::PipelineStageFlags2,
        commands: impl FnOnce(&mut Self) -> Result<()>,
    ) -> Result<()> {
        let recorded = &mut self.frame.recorded;
        if recorded.len() as u32 == MOST_COMMANDS {
            return Err(DeviceError::Program {
                part: format!("pass {name}"),
                problem: format!("a frame records at most {MOST_COMMANDS} commands"),
            }
            .into());
        }
        let query = 2 * recorded.len() as u32;
        recorded.push(Recorded {
            name,
            kind,
            work: Work::default(),
        });
        self.barrier(
            stage,
            vk::AccessFlags2::MEMORY_READ | vk::AccessFlags2::MEMORY_WRITE,
        );
        self.open_label(name);
        self.timestamp(query);
        commands(self)?;
        self.timestamp(query + 1);
        self.close_label();
        Ok(())
    }

    /// Sets the work of the command that was recorded last.
    pub fn state_work(&mut self, work: Work) {
        if let Some(recorded) = self.frame.recorded.last_mut() {
            recorded.work = work;
        }
    }

    /// Records a command that copies or clears.
    pub(super) fn record_transfer(
        &mut self,
        name: &'static str,
        stage: vk::PipelineStageFlags2,
        commands: impl FnOnce(&mut Self) -> Result<()>,
    ) -> Result<()> {
        self.record_command(name, CommandKind::Transfer, stage, commands)
    }

    fn timestamp(&self, query: u32) {
        if self.frame.device.timed_by_host {
            return;
        }
        let (raw, commands) = self.raw();
        // SAFETY: the command buffer is recording; the query was reset and is written once.
        unsafe {
            raw.cmd_write_timestamp2(
                commands,
                vk::PipelineStageFlags2::ALL_COMMANDS,
                self.frame.queries,
                query,
            )
        };
    }

    fn open_label(&self, name: &'static str) {
        let Some(labels) = &self.frame.device.labels else {
            return;
        };
        let name = std::ffi::CString::new(name).unwrap_or_default();
        let label = vk::DebugUtilsLabelEXT::default().label_name(&name);
        // SAFETY: the command buffer is recording, and the name outlives the call.
        unsafe { labels.cmd_begin_debug_utils_label(self.frame.commands, &label) };
    }

    fn close_label(&self) {
        if let Some(labels) = &self.frame.device.labels {
            // SAFETY: a label was opened by `open_label`.
            unsafe { labels.cmd_end_debug_utils_label(self.frame.commands) };
        }
    }
}

fn reset(frame: &mut Frame) -> Result<(), vk::Result> {
    frame.sets.reset()?;
    let raw = &frame.device.raw;
    let once =
        vk::CommandBufferBeginInfo::default().flags(vk::CommandBufferUsageFlags::ONE_TIME_SUBMIT);
    // SAFETY: the previous submission has been waited for, so nothing is in use; the reset also
    // drops what an error left half recorded.
    unsafe {
        raw.reset_command_buffer(frame.commands, vk::CommandBufferResetFlags::empty())?;
        raw.begin_command_buffer(frame.commands, &once)?;
        raw.cmd_reset_query_pool(frame.commands, frame.queries, 0, 2 * MOST_COMMANDS);
    }
    Ok(())
}
