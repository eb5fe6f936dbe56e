//! Commands of a frame on an image of a window. Unlike all others, such an image changes its layout, since the window
//! system needs one of its own.

use ash::vk;

use super::super::frame::Frame;
use super::super::image::{COLOR, COLOR_LAYER, Image};
use super::super::timing::Work;
use super::surface::Target;
use crate::error::Result;

impl Frame {
    /// Prepares an image of the window for drawing, in one colour.
    pub fn open_target(&mut self, target: &Target, rgb: [f32; 3]) -> Result<()> {
        let [r, g, b] = rgb;
        let color = vk::ClearColorValue {
            float32: [r, g, b, 1.0],
        };
        self.copied("clear", vk::PipelineStageFlags2::ALL_COMMANDS, |frame| {
            frame.change_layout(target, vk::ImageLayout::UNDEFINED, vk::ImageLayout::GENERAL);
            // SAFETY: the command buffer is recording, and the image is in this layout.
            unsafe {
                frame.device.raw.cmd_clear_color_image(
                    frame.commands,
                    target.image,
                    vk::ImageLayout::GENERAL,
                    &color,
                    &[COLOR],
                )
            };
            Ok(())
        })
    }

    /// Prepares a finished image for being shown.
    pub fn close_target(&mut self, target: &Target) {
        let to = vk::ImageLayout::PRESENT_SRC_KHR;
        self.change_layout(target, vk::ImageLayout::GENERAL, to);
    }

    fn change_layout(&self, target: &Target, from: vk::ImageLayout, to: vk::ImageLayout) {
        let any = vk::AccessFlags2::MEMORY_READ | vk::AccessFlags2::MEMORY_WRITE;
        let barriers = [vk::ImageMemoryBarrier2::default()
            .src_stage_mask(vk::PipelineStageFlags2::ALL_COMMANDS)
            .src_access_mask(any)
            .dst_stage_mask(vk::PipelineStageFlags2::ALL_COMMANDS)
            .dst_access_mask(any)
            .old_layout(from)
            .new_layout(to)
            .image(target.image)
            .subresource_range(COLOR)];
        let info = vk::DependencyInfo::default().image_memory_barriers(&barriers);
        // SAFETY: the command buffer is recording, and the image outlives the submission.
        unsafe { self.device.raw.cmd_pipeline_barrier2(self.commands, &info) };
    }

    /// Copies the part of an image from its lowest corner to `extent` into the rectangle [low, high) of the target,
    /// stretched.
    pub fn stretch_into(
        &mut self,
        from: &Image,
        extent: [u32; 2],
        target: &Target,
        [low, high]: [[u32; 2]; 2],
    ) -> Result<()> {
        let corner = |[x, y]: [u32; 2], z: i32| vk::Offset3D {
            x: x as i32,
            y: y as i32,
            z,
        };
        let region = vk::ImageBlit {
            src_subresource: COLOR_LAYER,
            src_offsets: [corner([0, 0], 0), corner(extent, 1)],
            dst_subresource: COLOR_LAYER,
            dst_offsets: [corner(low, 0), corner(high, 1)],
        };
        self.begin_images(std::iter::once(from))?;
        self.transfer("place", Work::default(), |raw, commands| {
            // SAFETY: the command buffer is recording; both rectangles lie inside their images.
            unsafe {
                raw.cmd_blit_image(
                    commands,
                    from.raw,
                    vk::ImageLayout::GENERAL,
                    target.image,
                    vk::ImageLayout::GENERAL,
                    &[region],
                    vk::Filter::LINEAR,
                )
            };
        })
    }
}
