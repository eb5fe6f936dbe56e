//! An image of a window, and commands on it. Unlike all others, such an image changes its layout, since the window system
//! needs one of its own.

use ash::vk;

use super::super::image::{COLOR, COLOR_LAYER, Image};
use super::super::recording::Recording;
use super::super::timing::Work;
use super::surface::failed;
use super::swapchain::Swapchain;
use crate::error::{DeviceError, Result};

/// How long to wait for an image from the window system before the frame is left out.
const ACQUIRE_TIMEOUT_NS: u64 = 500_000_000;

impl Swapchain {
    /// The next image to draw on; `None` if the window has changed, or shows nothing for now.
    pub fn acquire(&mut self) -> Result<Option<Target<'_>>> {
        let device = self.surface.device.clone();
        // SAFETY: the fence is unsignalled and waited for here.
        let acquired = unsafe {
            self.loader.acquire_next_image(
                self.raw,
                ACQUIRE_TIMEOUT_NS,
                vk::Semaphore::null(),
                self.acquired,
            )
        };
        let index = match acquired {
            Ok((index, _)) => index,
            Err(
                vk::Result::ERROR_OUT_OF_DATE_KHR | vk::Result::TIMEOUT | vk::Result::NOT_READY,
            ) => return Ok(None),
            Err(e) => return Err(failed(&device, e)),
        };
        // SAFETY: the acquisition signals the fence.
        unsafe {
            device
                .raw
                .wait_for_fences(&[self.acquired], true, u64::MAX)
                .and_then(|()| device.raw.reset_fences(&[self.acquired]))
        }
        .map_err(|e| failed(&device, e))?;
        Ok(Some(Target::new(self, index)))
    }
}

/// An image of the window, to be drawn on and then shown. Until then the swapchain keeps its images, as it is borrowed.
pub struct Target<'s> {
    swapchain: &'s mut Swapchain,
    index: u32,
    pub(in crate::gpu) image: vk::Image,
    pub(in crate::gpu) view: vk::ImageView,
    pub extent: [u32; 2],
}

impl<'s> Target<'s> {
    /// The image of this index, which the window system has handed over.
    fn new(swapchain: &'s mut Swapchain, index: u32) -> Target<'s> {
        Target {
            index,
            image: swapchain.images[index as usize],
            view: swapchain.views[index as usize],
            extent: swapchain.shape.extent,
            swapchain,
        }
    }

    /// Shows the image once it has been drawn on. False if the window has another shape by now.
    pub fn present(self) -> Result<bool> {
        let Swapchain {
            surface,
            loader,
            raw,
            shape,
            ..
        } = self.swapchain;
        let device = &surface.device;
        let (swapchains, indices) = ([*raw], [self.index]);
        let info = vk::PresentInfoKHR::default()
            .swapchains(&swapchains)
            .image_indices(&indices);
        let queue = device.queue();
        // SAFETY: the image was acquired, and what drew on it has been waited for.
        match unsafe { loader.queue_present(*queue, &info) } {
            Ok(false) => Ok(true),
            // Some drivers say so of each image, also of new ones of the right shape.
            Ok(true) => {
                let now = surface.shape(shape.extent)?;
                Ok(now.extent == shape.extent && now.transform == shape.transform)
            }
            Err(vk::Result::ERROR_OUT_OF_DATE_KHR) => Ok(false),
            Err(e) => Err(failed(device, e)),
        }
    }
}

impl<'r> Recording<'_, 'r> {
    /// Prepares an image of the window for drawing, in one colour.
    pub fn open_target(&mut self, target: &'r Target<'_>, rgb: [f32; 3]) -> Result<()> {
        let [r, g, b] = rgb;
        let color = vk::ClearColorValue {
            float32: [r, g, b, 1.0],
        };
        self.record_transfer(
            "clear",
            vk::PipelineStageFlags2::ALL_COMMANDS,
            |recording| {
                recording.change_layout(
                    target,
                    vk::ImageLayout::UNDEFINED,
                    vk::ImageLayout::GENERAL,
                );
                let (raw, commands) = recording.raw();
                // SAFETY: the command buffer is recording, and the image is in this layout.
                unsafe {
                    raw.cmd_clear_color_image(
                        commands,
                        target.image,
                        vk::ImageLayout::GENERAL,
                        &color,
                        &[COLOR],
                    )
                };
                Ok(())
            },
        )
    }

    /// Prepares a finished image for being shown.
    pub fn close_target(&mut self, target: &'r Target<'_>) {
        let to = vk::ImageLayout::PRESENT_SRC_KHR;
        self.change_layout(target, vk::ImageLayout::GENERAL, to);
    }

    fn change_layout(&self, target: &'r Target<'_>, from: vk::ImageLayout, to: vk::ImageLayout) {
        let (raw, commands) = self.raw();
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
        // SAFETY: the command buffer is recording, and the target is borrowed until its work has ended.
        unsafe { raw.cmd_pipeline_barrier2(commands, &info) };
    }

    /// Copies the part of an image from its lowest corner to `extent` into the rectangle [low, high) of the target,
    /// stretched.
    pub fn blit(
        &mut self,
        from: &'r Image,
        extent: [u32; 2],
        target: &'r Target<'_>,
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
        check_region(from, extent, target, [low, high])?;
        self.begin_images(std::iter::once(from))?;
        self.transfer("place", Work::default(), |raw, commands| {
            // SAFETY: the command buffer is recording; both rectangles lie inside their images, which are borrowed until its
            // work has ended.
            unsafe {
                raw.cmd_blit_image(
                    commands,
                    from.handle(),
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

/// Fails for rectangles that do not lie inside their images.
fn check_region(
    from: &Image,
    extent: [u32; 2],
    target: &Target<'_>,
    [low, high]: [[u32; 2]; 2],
) -> Result<()> {
    let is_inside = |a: usize| {
        extent[a] <= from.desc.extent[a] && low[a] < high[a] && high[a] <= target.extent[a]
    };
    if (0..2).all(is_inside) {
        return Ok(());
    }
    Err(DeviceError::Program {
        part: format!("blit of {} to the window", from.desc.name),
        problem: format!(
            "{extent:?} of {:?} texels, or {low:?} to {high:?} of {:?} pixels, do not lie inside",
            from.desc.extent, target.extent
        ),
    }
    .into())
}
