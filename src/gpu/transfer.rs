//! Transfers: clears, copies, and the first use of an image.

use ash::vk;

use super::buffer::{Buffer, Placement};
use super::image::{COLOR, COLOR_LAYER, Image};
use super::recording::Recording;
use super::timing::Work;
use crate::error::{DeviceError, Result};

/// A box [`low`, `low` + `extent`) of texels, and its offset in a buffer, x fastest.
#[derive(Debug, Clone, Copy)]
pub struct Piece {
    pub offset: u64,
    pub low: [u32; 3],
    pub extent: [u32; 3],
}

impl<'r> Recording<'_, 'r> {
    /// Brings those images that no command has used yet into the GENERAL layout, and clears those that begin with
    /// zeros.
    pub(super) fn begin_images(&mut self, images: impl Iterator<Item = &'r Image>) -> Result<()> {
        let mut new = Vec::new();
        for image in images {
            if image.is_new() && !self.begun.iter().any(|begun| std::ptr::eq(*begun, image)) {
                self.begun.push(image);
                new.push(image);
            }
        }
        if new.is_empty() {
            return Ok(());
        }
        self.record_transfer(
            "begin",
            vk::PipelineStageFlags2::ALL_TRANSFER,
            |recording| {
                recording.to_general(&new);
                new.retain(|image| image.desc.zeroed);
                recording.fill_images(&new, [0.0; 4]);
                Ok(())
            },
        )
    }

    /// Sets all texels of the images to zero.
    pub fn clear(&mut self, images: &[&'r Image]) -> Result<()> {
        self.clear_to(images, [0.0; 4])
    }

    /// Sets all texels of the images to `texel`.
    pub fn clear_to(&mut self, images: &[&'r Image], texel: [f32; 4]) -> Result<()> {
        self.begin_images(images.iter().copied())?;
        self.record_transfer(
            "clear",
            vk::PipelineStageFlags2::ALL_TRANSFER,
            |recording| {
                recording.fill_images(images, texel);
                Ok(())
            },
        )
    }

    fn fill_images(&mut self, images: &[&'r Image], texel: [f32; 4]) {
        let (raw, commands) = self.raw();
        let color = vk::ClearColorValue { float32: texel };
        for image in images {
            // SAFETY: the command buffer is recording, and the image is borrowed until its work has ended.
            unsafe {
                raw.cmd_clear_color_image(
                    commands,
                    image.handle(),
                    vk::ImageLayout::GENERAL,
                    &color,
                    &[COLOR],
                );
            }
        }
        let bytes = images.iter().map(|image| image.desc.bytes()).sum();
        self.state_work(Work::fill(bytes));
    }

    fn to_general(&self, images: &[&'r Image]) {
        let barriers: Vec<_> = images
            .iter()
            .map(|image| {
                vk::ImageMemoryBarrier2::default()
                    .src_stage_mask(vk::PipelineStageFlags2::ALL_COMMANDS)
                    .dst_stage_mask(vk::PipelineStageFlags2::ALL_TRANSFER)
                    .dst_access_mask(vk::AccessFlags2::TRANSFER_WRITE)
                    .old_layout(vk::ImageLayout::UNDEFINED)
                    .new_layout(vk::ImageLayout::GENERAL)
                    .image(image.handle())
                    .subresource_range(COLOR)
            })
            .collect();
        let info = vk::DependencyInfo::default().image_memory_barriers(&barriers);
        let (raw, commands) = self.raw();
        // SAFETY: the command buffer is recording, and the images are borrowed until its work has ended.
        unsafe { raw.cmd_pipeline_barrier2(commands, &info) };
    }

    /// Copies texels from the buffer's start into the box [`low`, `low` + `extent`).
    pub fn upload(
        &mut self,
        from: &'r Buffer,
        to: &'r Image,
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
    pub fn upload_pieces(
        &mut self,
        from: &'r Buffer,
        to: &'r Image,
        pieces: &[Piece],
    ) -> Result<()> {
        for piece in pieces {
            check_piece(to, from, piece)?;
        }
        self.begin_images(std::iter::once(to))?;
        let regions: Vec<_> = pieces
            .iter()
            .map(|piece| vk::BufferImageCopy {
                buffer_offset: piece.offset,
                ..region(piece.low, piece.extent)
            })
            .collect();
        let bytes = pieces
            .iter()
            .map(|piece| to.desc.bytes_of(piece.extent))
            .sum();
        self.transfer("upload", Work::copy(bytes), |raw, commands| {
            // SAFETY: the command buffer is recording; the boxes lie inside the image and the buffer, which are
            // borrowed until its work has ended.
            unsafe {
                raw.cmd_copy_buffer_to_image(
                    commands,
                    from.handle(),
                    to.handle(),
                    vk::ImageLayout::GENERAL,
                    &regions,
                )
            };
        })
    }

    /// Copies the box [`low`, `low` + `extent`) to the buffer's start.
    pub fn download(
        &mut self,
        from: &'r Image,
        to: &'r Buffer,
        low: [u32; 3],
        extent: [u32; 3],
    ) -> Result<()> {
        let piece = Piece {
            offset: 0,
            low,
            extent,
        };
        check_piece(from, to, &piece)?;
        self.begin_images(std::iter::once(from))?;
        let work = Work::copy(from.desc.bytes_of(extent));
        self.transfer("download", work, |raw, commands| {
            // SAFETY: the command buffer is recording; the box lies inside the image and the buffer, which are
            // borrowed until its work has ended.
            unsafe {
                raw.cmd_copy_image_to_buffer(
                    commands,
                    from.handle(),
                    vk::ImageLayout::GENERAL,
                    to.handle(),
                    &[region(low, extent)],
                )
            };
        })
    }

    /// Copies bytes from the start of `from` to the start of `to`, as many as both have.
    pub fn copy(&mut self, from: &'r Buffer, to: &'r Buffer) -> Result<()> {
        let bytes = from.desc.bytes.min(to.desc.bytes);
        let name = match to.desc.placement {
            Placement::Device => "upload",
            Placement::Upload | Placement::HostCached => "download",
        };
        self.transfer(name, Work::copy(bytes), |raw, commands| {
            let region = vk::BufferCopy::default().size(bytes);
            // SAFETY: the command buffer is recording, and the buffers are borrowed until its work has ended.
            unsafe { raw.cmd_copy_buffer(commands, from.handle(), to.handle(), &[region]) };
        })
    }

    /// Sets every whole word of the buffer to zero.
    pub fn zero(&mut self, buffer: &'r Buffer) -> Result<()> {
        let work = Work::fill(buffer.desc.bytes);
        self.transfer("clear", work, |raw, commands| {
            // SAFETY: the command buffer is recording, and the buffer is borrowed until its work has ended.
            unsafe { raw.cmd_fill_buffer(commands, buffer.handle(), 0, vk::WHOLE_SIZE, 0) };
        })
    }

    /// Records a transfer with `record`, under `name`, as one that does `work`.
    pub(super) fn transfer(
        &mut self,
        name: &'static str,
        work: Work,
        record: impl FnOnce(&ash::Device, vk::CommandBuffer),
    ) -> Result<()> {
        self.record_transfer(name, vk::PipelineStageFlags2::ALL_TRANSFER, |recording| {
            let (raw, commands) = recording.raw();
            record(raw, commands);
            recording.state_work(work);
            Ok(())
        })
    }
}

/// Fails for a box that does not lie inside the image, or whose texels do not lie inside the buffer.
fn check_piece(image: &Image, buffer: &Buffer, piece: &Piece) -> Result<()> {
    let is_inside = |a: usize| {
        let end = piece.low[a].checked_add(piece.extent[a]);
        end.is_some_and(|end| end <= image.desc.extent[a])
    };
    let end = piece.offset + image.desc.bytes_of(piece.extent);
    if (0..3).all(is_inside) && end <= buffer.desc.bytes {
        return Ok(());
    }
    Err(DeviceError::Program {
        part: format!("copy between {} and {}", image.desc.name, buffer.desc.name),
        problem: format!(
            "{piece:?} does not lie inside {:?} texels and {} bytes",
            image.desc.extent, buffer.desc.bytes
        ),
    }
    .into())
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
