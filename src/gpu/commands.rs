//! What a frame can record: passes, clears and copies.

use std::time::Instant;

use ash::vk;

use super::buffer::Buffer;
use super::frame::Frame;
use super::image::{COLOR, COLOR_LAYER, Image};
use super::pass::{Binding, Pass};
use super::reflection::Slot;
use super::timing::Work;
use crate::error::Result;

/// How long a slice of a sliced pass should take where nobody is waiting for a frame.
pub const SLICE_MS: f64 = 50.0;

/// How far a pass that runs in slices has come.
#[derive(Debug, Clone, Copy)]
pub struct Slices {
    /// How long one should take.
    target_ms: f64,
    begin: u32,
    /// Workgroups along the axis in the next one.
    count: u32,
}

impl Slices {
    pub fn new(target_ms: f64) -> Slices {
        Slices {
            target_ms,
            begin: 0,
            count: 1,
        }
    }

    /// Begins again with the first, as long as the next would have been, or as `target_ms` is against that.
    pub fn restart(&mut self, target_ms: f64) {
        self.count = (self.count as f64 * target_ms / self.target_ms).ceil() as u32;
        self.target_ms = target_ms;
        self.begin = 0;
    }
}

/// A box [`low`, `low` + `extent`) of texels, and where a buffer holds them, x fastest.
#[derive(Debug, Clone, Copy)]
pub struct Piece {
    pub offset: u64,
    pub low: [u32; 3],
    pub extent: [u32; 3],
}

impl Frame {
    /// Runs `pass` over at least `threads` threads along x, y and z; the shader drops the excess.
    pub fn pass<P: bytemuck::NoUninit>(
        &mut self,
        pass: &Pass,
        bindings: &[(&str, Binding<'_>)],
        push: &P,
        threads: [u32; 3],
    ) -> Result<()> {
        self.begin_images(bindings.iter().filter_map(|(_, binding)| binding.image()))?;
        self.timed(
            pass.name,
            vk::PipelineStageFlags2::COMPUTE_SHADER,
            |frame| {
                frame.bind(pass, bindings)?;
                frame.dispatch(pass, bytemuck::bytes_of(push), [0; 3], pass.groups(threads))
            },
        )
    }

    fn bind(&mut self, pass: &Pass, bindings: &[(&str, Binding<'_>)]) -> Result<()> {
        let wrong = |problem: String| pass.unfit(problem);
        if let Some((name, _)) = bindings
            .iter()
            .find(|(name, _)| !pass.slots.iter().any(|s| s.name == *name))
        {
            return Err(wrong(format!(
                "the shader has no {name}, only {}",
                pass.slots
                    .iter()
                    .map(|s| s.name.as_str())
                    .collect::<Vec<_>>()
                    .join(", ")
            )));
        }
        let info = |image: &Image, sampler| {
            vk::DescriptorImageInfo::default()
                .sampler(sampler)
                .image_view(image.view)
                .image_layout(vk::ImageLayout::GENERAL)
        };
        let mut buffers = Vec::with_capacity(pass.slots.len());
        let mut images = Vec::with_capacity(pass.slots.len());
        for slot in &pass.slots {
            let (_, resource) = bindings
                .iter()
                .find(|(name, _)| *name == slot.name)
                .ok_or_else(|| wrong(format!("{} is not bound", slot.name)))?;
            match resource {
                Binding::Buffer(b) => buffers.push((
                    slot,
                    [vk::DescriptorBufferInfo::default()
                        .buffer(b.raw)
                        .range(vk::WHOLE_SIZE)],
                )),
                Binding::Image(i) => images.push((slot, [info(i, self.device.nearest)])),
                Binding::Filtered(i) => images.push((slot, [info(i, self.device.linear)])),
            }
        }
        let write = |slot: &Slot| {
            vk::WriteDescriptorSet::default()
                .dst_binding(slot.binding)
                .descriptor_type(slot.kind)
        };
        let mut writes: Vec<_> = buffers
            .iter()
            .map(|(slot, info)| write(slot).buffer_info(info))
            .chain(
                images
                    .iter()
                    .map(|(slot, info)| write(slot).image_info(info)),
            )
            .collect();
        let point = vk::PipelineBindPoint::COMPUTE;
        self.bind_resources(point, &pass.pipeline, &mut writes)
            .map_err(|e| self.lost(e))
    }

    /// `count` workgroups from workgroup `begin` on.
    fn dispatch(&self, pass: &Pass, push: &[u8], begin: [u32; 3], count: [u32; 3]) -> Result<()> {
        if push.len() != pass.push_bytes as usize {
            return Err(pass.unfit(format!(
                "it takes {} bytes of push constants, not {}",
                pass.push_bytes,
                push.len()
            )));
        }
        let most = self.device.most_groups;
        if (0..3).any(|a| begin[a] + count[a] > most[a]) {
            return Err(pass.unfit(format!(
                "it needs {count:?} workgroups from {begin:?} on, but {} runs at most {most:?}",
                self.device.summary.name
            )));
        }
        let raw = &self.device.raw;
        // SAFETY: the command buffer is recording, and the pipeline and its layout are alive.
        unsafe {
            raw.cmd_bind_pipeline(
                self.commands,
                vk::PipelineBindPoint::COMPUTE,
                pass.pipeline.raw,
            );
            if !push.is_empty() {
                raw.cmd_push_constants(
                    self.commands,
                    pass.pipeline.layout,
                    vk::ShaderStageFlags::COMPUTE,
                    0,
                    push,
                );
            }
            let [x, y, z] = count;
            match begin {
                // Synchronization validation (1.3.239) does not see the other one.
                [0, 0, 0] => raw.cmd_dispatch(self.commands, x, y, z),
                [i, j, k] => raw.cmd_dispatch_base(self.commands, i, j, k, x, y, z),
            }
        }
        Ok(())
    }

    /// Brings those images that no command has used yet into the GENERAL layout, and clears those that are to
    /// begin with zeros.
    pub(super) fn begin_images<'a>(
        &mut self,
        images: impl Iterator<Item = &'a Image>,
    ) -> Result<()> {
        let mut new = Vec::new();
        for image in images {
            if let Some(mark) = image.begin() {
                self.begun.push(mark);
                new.push(image);
            }
        }
        if new.is_empty() {
            return Ok(());
        }
        self.timed("begin", vk::PipelineStageFlags2::ALL_TRANSFER, |frame| {
            frame.to_general(&new);
            for image in new.iter().filter(|image| image.desc.zeroed) {
                frame.fill_image(image, [0.0; 4]);
            }
            Ok(())
        })
    }

    /// Sets all texels of the images to zero.
    pub fn clear(&mut self, images: &[&Image]) -> Result<()> {
        self.clear_to(images, [0.0; 4])
    }

    /// Sets all texels of the images to `texel`.
    pub fn clear_to(&mut self, images: &[&Image], texel: [f32; 4]) -> Result<()> {
        self.begin_images(images.iter().copied())?;
        self.timed("clear", vk::PipelineStageFlags2::ALL_TRANSFER, |frame| {
            for image in images {
                frame.fill_image(image, texel);
            }
            Ok(())
        })
    }

    fn fill_image(&self, image: &Image, texel: [f32; 4]) {
        let color = vk::ClearColorValue { float32: texel };
        // SAFETY: the command buffer is recording, and the image outlives the submission.
        unsafe {
            self.device.raw.cmd_clear_color_image(
                self.commands,
                image.raw,
                vk::ImageLayout::GENERAL,
                &color,
                &[COLOR],
            );
        }
    }

    fn to_general(&self, images: &[&Image]) {
        let barriers: Vec<_> = images
            .iter()
            .map(|image| {
                vk::ImageMemoryBarrier2::default()
                    .src_stage_mask(vk::PipelineStageFlags2::ALL_COMMANDS)
                    .dst_stage_mask(vk::PipelineStageFlags2::ALL_TRANSFER)
                    .dst_access_mask(vk::AccessFlags2::TRANSFER_WRITE)
                    .old_layout(vk::ImageLayout::UNDEFINED)
                    .new_layout(vk::ImageLayout::GENERAL)
                    .image(image.raw)
                    .subresource_range(COLOR)
            })
            .collect();
        let info = vk::DependencyInfo::default().image_memory_barriers(&barriers);
        // SAFETY: the command buffer is recording, and the images outlive the submission.
        unsafe { self.device.raw.cmd_pipeline_barrier2(self.commands, &info) };
    }

    /// Copies texels from the buffer's start into the box [`low`, `low` + `extent`).
    pub fn upload(
        &mut self,
        from: &Buffer,
        to: &Image,
        low: [u32; 3],
        extent: [u32; 3],
    ) -> Result<()> {
        let piece = Piece {
            offset: 0,
            low,
            extent,
        };
        self.upload_pieces(from, to, &[piece])
    }

    /// Copies texels from several places in the buffer into a box each; the boxes do not overlap.
    pub fn upload_pieces(&mut self, from: &Buffer, to: &Image, pieces: &[Piece]) -> Result<()> {
        self.begin_images(std::iter::once(to))?;
        let regions: Vec<_> = pieces
            .iter()
            .map(|piece| vk::BufferImageCopy {
                buffer_offset: piece.offset,
                ..region(piece.low, piece.extent)
            })
            .collect();
        let bytes = pieces.iter().map(|piece| bytes_of(to, piece.extent)).sum();
        self.transfer("upload", bytes, |raw, commands| {
            // SAFETY: the command buffer is recording; the boxes lie inside the image.
            unsafe {
                raw.cmd_copy_buffer_to_image(
                    commands,
                    from.raw,
                    to.raw,
                    vk::ImageLayout::GENERAL,
                    &regions,
                )
            };
        })
    }

    /// Copies the box [`low`, `low` + `extent`) to the buffer's start.
    pub fn download(
        &mut self,
        from: &Image,
        to: &Buffer,
        low: [u32; 3],
        extent: [u32; 3],
    ) -> Result<()> {
        self.begin_images(std::iter::once(from))?;
        self.transfer("download", bytes_of(from, extent), |raw, commands| {
            // SAFETY: the command buffer is recording; the box lies inside the image.
            unsafe {
                raw.cmd_copy_image_to_buffer(
                    commands,
                    from.raw,
                    vk::ImageLayout::GENERAL,
                    to.raw,
                    &[region(low, extent)],
                )
            };
        })
    }

    /// Copies bytes from the start of `from` to the start of `to`, as many as both have.
    pub fn copy(&mut self, from: &Buffer, to: &Buffer) -> Result<()> {
        let bytes = from.desc.bytes.min(to.desc.bytes);
        self.transfer("download", bytes, |raw, commands| {
            let region = vk::BufferCopy::default().size(bytes);
            // SAFETY: the command buffer is recording, and the buffers outlive the submission.
            unsafe { raw.cmd_copy_buffer(commands, from.raw, to.raw, &[region]) };
        })
    }

    /// Sets every byte of the buffer to zero.
    pub fn zero(&mut self, buffer: &Buffer) -> Result<()> {
        self.transfer("clear", 0, |raw, commands| {
            // SAFETY: the command buffer is recording, and the buffer outlives the submission.
            unsafe { raw.cmd_fill_buffer(commands, buffer.raw, 0, vk::WHOLE_SIZE, 0) };
        })
    }

    /// A transfer of some kind, which copies so many bytes; `record` records it.
    pub(super) fn transfer(
        &mut self,
        name: &'static str,
        copied_bytes: u64,
        record: impl FnOnce(&ash::Device, vk::CommandBuffer),
    ) -> Result<()> {
        self.timed(name, vk::PipelineStageFlags2::ALL_TRANSFER, |frame| {
            record(&frame.device.raw, frame.commands);
            frame.state_work(Work {
                copied_bytes,
                ..Work::default()
            });
            Ok(())
        })
    }

    /// Runs `pass` over at least `threads` threads in submissions of its own, slice after slice along
    /// the last axis, so that none of them takes much longer than [`SLICE_MS`] whatever the device:
    /// Windows resets a GPU that is busy for two seconds.
    pub fn run_in_slices<P: bytemuck::NoUninit>(
        &mut self,
        pass: &Pass,
        bindings: &[(&str, Binding<'_>)],
        push: &P,
        threads: [u32; 3],
    ) -> Result<()> {
        let mut slices = Slices::new(SLICE_MS);
        while !self.run_slice(pass, bindings, push, threads, &mut slices)? {}
        Ok(())
    }

    /// The next slice of such a pass. Returns whether it was the last.
    pub fn run_slice<P: bytemuck::NoUninit>(
        &mut self,
        pass: &Pass,
        bindings: &[(&str, Binding<'_>)],
        push: &P,
        threads: [u32; 3],
        slices: &mut Slices,
    ) -> Result<bool> {
        let groups = pass.groups(threads);
        let axis = if groups[2] > 1 { 2 } else { 1 };
        let (mut begin, mut count) = ([0; 3], groups);
        begin[axis] = slices.begin;
        count[axis] = slices.count.min(groups[axis] - slices.begin);
        let began = Instant::now();
        self.run(|f| {
            f.begin_images(bindings.iter().filter_map(|(_, binding)| binding.image()))?;
            f.timed(pass.name, vk::PipelineStageFlags2::COMPUTE_SHADER, |f| {
                f.bind(pass, bindings)?;
                f.dispatch(pass, bytemuck::bytes_of(push), begin, count)
            })
        })?;
        let took_ms = began.elapsed().as_secs_f64() * 1e3;
        let growth = (slices.target_ms / took_ms).clamp(0.5, 8.0);
        slices.begin += count[axis];
        slices.count = (count[axis] as f64 * growth).ceil() as u32;
        Ok(slices.begin == groups[axis])
    }
}

/// Bytes of a box of texels.
fn bytes_of(image: &Image, extent: [u32; 3]) -> u64 {
    let texels: u64 = extent.iter().map(|&n| u64::from(n)).product();
    texels * image.desc.texel_bytes() as u64
}

fn region([x, y, z]: [u32; 3], [width, height, depth]: [u32; 3]) -> vk::BufferImageCopy {
    vk::BufferImageCopy {
        image_subresource: COLOR_LAYER,
        image_offset: vk::Offset3D {
            x: x as i32,
            y: y as i32,
            z: z as i32,
        },
        image_extent: vk::Extent3D {
            width,
            height,
            depth,
        },
        ..Default::default()
    }
}
