//! A command buffer at rest, and its submission, which is waited for; then the times of what was recorded are read.
//! `recording.rs` is the command buffer while it is recorded.

use std::sync::Arc;

use ash::vk;

use super::descriptors::DescriptorSets;
use super::device::Device;
use super::failure::failure;
use super::queue::submit_to_queue;
use super::slices::SLICE_MS;
use super::timing::{Span, Timings, Work};
use crate::error::{Error, Result};

/// Passes, copies and clears between two submissions, at most.
pub(super) const MOST_COMMANDS: u32 = 64;

/// A command of the submission under way.
pub(super) struct Recorded {
    pub name: &'static str,
    pub kind: CommandKind,
    pub work: Work,
}

#[derive(Clone, Copy, PartialEq)]
pub(super) enum CommandKind {
    /// Of a pass, or of the window's interface.
    Pass,
    /// It copies or clears.
    Transfer,
}

/// A command buffer, its fence and its queries, used again and again.
pub struct Frame {
    pub(super) device: Arc<Device>,
    pool: vk::CommandPool,
    pub(super) commands: vk::CommandBuffer,
    fence: vk::Fence,
    pub(super) queries: vk::QueryPool,
    pub(super) sets: DescriptorSets,
    /// The commands of the recording under way, or of the last one.
    pub(super) recorded: Vec<Recorded>,
    pub(super) leave_out_barriers: bool,
    pub timings: Timings,
    /// Time that a slice of work should take, in milliseconds: a window sets less than [`SLICE_MS`] while its next frame is
    /// due.
    pub slice_ms: f64,
}

impl Frame {
    pub fn new(device: &Arc<Device>) -> Result<Frame> {
        let mut frame = Frame {
            device: device.clone(),
            pool: vk::CommandPool::null(),
            commands: vk::CommandBuffer::null(),
            fence: vk::Fence::null(),
            queries: vk::QueryPool::null(),
            sets: DescriptorSets::new(device),
            recorded: Vec::new(),
            leave_out_barriers: false,
            timings: Timings::default(),
            slice_ms: SLICE_MS,
        };
        frame.fill().map_err(|e| frame.failed(e))?;
        Ok(frame)
    }

    fn fill(&mut self) -> Result<(), vk::Result> {
        let raw = &self.device.raw;
        let pool = vk::CommandPoolCreateInfo::default()
            .queue_family_index(self.device.queue_family)
            .flags(vk::CommandPoolCreateFlags::RESET_COMMAND_BUFFER);
        let queries = vk::QueryPoolCreateInfo::default()
            .query_type(vk::QueryType::TIMESTAMP)
            .query_count(2 * MOST_COMMANDS);
        // SAFETY: all infos are valid; everything is destroyed in Drop.
        unsafe {
            self.pool = raw.create_command_pool(&pool, None)?;
            self.fence = raw.create_fence(&vk::FenceCreateInfo::default(), None)?;
            self.queries = raw.create_query_pool(&queries, None)?;
            let buffers = vk::CommandBufferAllocateInfo::default()
                .command_pool(self.pool)
                .level(vk::CommandBufferLevel::PRIMARY)
                .command_buffer_count(1);
            self.commands = raw.allocate_command_buffers(&buffers)?[0];
        }
        Ok(())
    }

    pub fn device(&self) -> Arc<Device> {
        self.device.clone()
    }

    /// Submits what was recorded, and waits for it.
    pub(super) fn submit(&mut self) -> Result<(), vk::Result> {
        let raw = &self.device.raw;
        let commands = [vk::CommandBufferSubmitInfo::default().command_buffer(self.commands)];
        let submit = [vk::SubmitInfo2::default().command_buffer_infos(&commands)];
        let submitted_us = self.timings.began.elapsed().as_secs_f64() * 1e6;
        // SAFETY: the recording has ended. Nothing waits for the fence any more, as the previous submission has ended. Where
        // waiting for this one fails, so that its objects might be destroyed while the device still works on them, the device
        // is waited for instead.
        unsafe {
            raw.reset_fences(&[self.fence])?;
            submit_to_queue(&self.device, &submit, self.fence)?;
            let waited = raw.wait_for_fences(&[self.fence], true, u64::MAX);
            if waited.is_err() {
                let _queue = self.device.queue();
                let _ = raw.device_wait_idle();
            }
            waited?;
        }
        if self.device.timed_by_host {
            self.time_by_host(submitted_us)
        } else {
            self.read_timestamps(submitted_us)?
        }
        Ok(())
    }

    /// The first pass of the submission, which takes most of its time; without a pass, the first copy.
    pub(super) fn main(&self) -> Option<&Recorded> {
        let mut recorded = self.recorded.iter();
        let pass = recorded.find(|recorded| recorded.kind == CommandKind::Pass);
        pass.or(self.recorded.first())
    }

    /// Attributes the time of the whole submission to its main pass. Others in it, such as the tone map after a march, are
    /// not listed.
    fn time_by_host(&mut self, submitted_us: f64) {
        let main = self.main().map(|main| (main.name, main.work));
        if let Some((pass, work)) = main {
            let now_us = self.timings.began.elapsed().as_secs_f64() * 1e6;
            self.timings.record(Span {
                pass,
                start_us: submitted_us,
                duration_us: now_us - submitted_us,
                work,
            });
        }
    }

    fn read_timestamps(&mut self, submitted_us: f64) -> Result<(), vk::Result> {
        let mut ticks = vec![0u64; 2 * self.recorded.len()];
        if ticks.is_empty() {
            return Ok(());
        }
        // SAFETY: the work is done, and the slice holds one result for each query written.
        unsafe {
            self.device.raw.get_query_pool_results(
                self.queries,
                0,
                &mut ticks,
                vk::QueryResultFlags::TYPE_64 | vk::QueryResultFlags::WAIT,
            )?
        };
        let us = |from: u64, to: u64| {
            let ticks = ticks_between(from, to, self.device.timestamp_mask);
            ticks as f64 * self.device.timestamp_period_ns / 1e3
        };
        for (recorded, t) in self.recorded.iter().zip(ticks.chunks_exact(2)) {
            self.timings.record(Span {
                pass: recorded.name,
                start_us: submitted_us + us(ticks[0], t[0]),
                duration_us: us(t[0], t[1]),
                work: recorded.work,
            });
        }
        Ok(())
    }

    /// An error of the driver's, naming the command that was recorded last, if there is one.
    pub(super) fn failed(&self, error: vk::Result) -> Error {
        self.failed_in(self.recorded.last(), error)
    }

    pub(super) fn failed_in(&self, recorded: Option<&Recorded>, error: vk::Result) -> Error {
        let place = recorded.map_or(String::new(), |r| format!(" in {}", r.name));
        failure(error, format!("{} failed{place}", self.device.summary.name))
    }
}

/// The ticks from one timestamp to the next, of which the bits in `mask` count: 36 bits wrap around after an hour or
/// two. 0 if the second is the earlier one.
fn ticks_between(from: u64, to: u64, mask: u64) -> u64 {
    match to.wrapping_sub(from) & mask {
        ticks if ticks <= mask / 2 => ticks,
        _ => 0,
    }
}

impl Drop for Frame {
    fn drop(&mut self) {
        let raw = &self.device.raw;
        // SAFETY: `run` waits for what it submits, so nothing is in use.
        unsafe {
            raw.destroy_query_pool(self.queries, None);
            raw.destroy_fence(self.fence, None);
            raw.destroy_command_pool(self.pool, None);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::gpu::{
        Binding, Buffer, DeviceChoice, Memory, Pass, PassDesc, Placement, Shaders, Validation,
    };

    const RELAY: &str = "#version 460
        #extension GL_EXT_scalar_block_layout : require
        layout(local_size_x = 1) in;
        layout(scalar) readonly buffer FromBlock { uint at; } from;
        layout(scalar) writeonly buffer ToBlock { uint at; } to;
        void main() { to.at = from.at; }";

    /// What validation says of two passes, the second of which reads what the first has written.
    fn messages(leave_out_barriers: bool) -> Vec<String> {
        let choice = DeviceChoice {
            validation: Validation::On,
            ..DeviceChoice::default()
        };
        let device = Device::open(&choice).expect("a Vulkan device and the validation layers");
        let memory = Memory::new(&device, 1 << 20).expect("memory");
        let shaders = Shaders::new(String::new());
        let shaders = shaders.with_file("relay.comp", RELAY);
        let desc = PassDesc {
            name: "relay",
            specialization: &[],
            push: "",
            macros: &[],
        };
        let pass = Pass::new(&device, &shaders, &desc).expect("a pass");
        let [a, b, c] = ["a", "b", "c"].map(|name| {
            Buffer::with_data_in(&memory, name, Placement::Upload, &[1u32]).expect("a buffer")
        });
        let mut frame = Frame::new(&device).expect("a frame");
        frame.leave_out_barriers = leave_out_barriers;
        let relays = [(&a, &b), (&b, &c)];
        frame
            .run(|recording| {
                relays.into_iter().try_for_each(|(from, to)| {
                    let bindings = [("from", Binding::Buffer(from)), ("to", Binding::Buffer(to))];
                    recording.dispatch(&pass, &bindings, &(), [1; 3])
                })
            })
            .expect("a run");
        device.validation_messages()
    }

    #[test]
    fn a_timestamp_that_wraps_around_is_the_later_one() {
        let mask = (1 << 36) - 1;
        assert_eq!(ticks_between(100, 350, mask), 250);
        assert_eq!(ticks_between(mask - 99, 150, mask), 250);
        // Bits beyond the mask are undefined.
        assert_eq!(ticks_between(7 << 36 | 100, 350, mask), 250);
        assert_eq!(ticks_between(350, 100, mask), 0);
        assert_eq!(ticks_between(350, 100, u64::MAX), 0);
    }

    /// All other tests take its silence for correct barriers.
    #[test]
    fn validation_reports_a_missing_barrier() {
        assert_eq!(messages(false), [""; 0]);
        let hazards = messages(true);
        let names_it = |m: &String| m.contains("SYNC-HAZARD-READ-AFTER-WRITE");
        assert!(hazards.iter().any(names_it), "{hazards:#?}");
    }
}
