//! The images that a window shows.
//!
//! Images are acquired with a fence and shown after the frame's own fence, so that no semaphore is needed: an image
//! is never shown before the frame that drew it has ended. The driver allocates them; the ledger counts the bytes
//! that images of that kind take.

use std::sync::Arc;

use ash::{khr, vk};

use super::super::image::COLOR;
use super::super::memory::{Holding, Memory};
use super::surface::{Shape, Surface, USAGE, failed};
use crate::error::Result;

/// The images of a window at one size.
pub struct Swapchain {
    pub(super) surface: Arc<Surface>,
    pub(super) loader: khr::swapchain::Device,
    pub(super) raw: vk::SwapchainKHR,
    pub(super) images: Vec<vk::Image>,
    pub(super) views: Vec<vk::ImageView>,
    pub(super) acquired: vk::Fence,
    pub(super) shape: Shape,
    holding: Holding,
}

impl Swapchain {
    /// Makes images of this shape; unless this is a dry run, it must be the surface's current shape.
    pub fn new(memory: &Arc<Memory>, surface: &Arc<Surface>, shape: Shape) -> Result<Swapchain> {
        let device = memory.device();
        let mut swapchain = Swapchain {
            surface: surface.clone(),
            loader: khr::swapchain::Device::new(&device.instance.raw, &device.raw),
            raw: vk::SwapchainKHR::null(),
            images: Vec::new(),
            views: Vec::new(),
            acquired: vk::Fence::null(),
            shape,
            holding: reserve(memory, surface, shape)?,
        };
        if memory.is_dry_run() {
            return Ok(swapchain);
        }
        let info = vk::SwapchainCreateInfoKHR::default()
            .surface(surface.raw())
            .min_image_count(shape.images)
            .image_format(surface.format.format)
            .image_color_space(surface.format.color_space)
            .image_extent(extent_2d(shape.extent))
            .image_array_layers(1)
            .image_usage(USAGE)
            .pre_transform(shape.transform)
            .composite_alpha(shape.alpha)
            .present_mode(vk::PresentModeKHR::FIFO)
            .clipped(true);
        swapchain.create(&info).map_err(|e| failed(device, e))?;
        swapchain.shape.images = swapchain.images.len() as u32;
        if swapchain.shape.images != shape.images {
            swapchain.holding.release();
            swapchain.holding = reserve(memory, surface, swapchain.shape)?;
        }
        swapchain.holding.note_allocated();
        Ok(swapchain)
    }

    pub fn shape(&self) -> Shape {
        self.shape
    }

    /// Adapts to the window's current size. The old images go first.
    pub fn resize(&mut self, wanted: [u32; 2]) -> Result<()> {
        let (memory, surface) = (self.holding.memory(), self.surface.clone());
        self.destroy();
        let shape = surface.shape(wanted)?;
        *self = Swapchain::new(&memory, &surface, shape)?;
        Ok(())
    }

    fn destroy(&mut self) {
        if self.raw != vk::SwapchainKHR::null() {
            self.destroy_images();
        }
        self.holding.release();
    }

    fn destroy_images(&mut self) {
        let device = &self.surface.device;
        let queue = device.queue();
        // SAFETY: no semaphore is used, and each frame's work has been waited for; so has what was presented, as far as it is
        // on the queue, where the guard keeps other threads off it. The images go with the swapchain.
        unsafe {
            let _ = device.raw.queue_wait_idle(*queue);
            for view in self.views.drain(..) {
                device.raw.destroy_image_view(view, None);
            }
            self.images.clear();
            device.raw.destroy_fence(self.acquired, None);
            self.loader.destroy_swapchain(self.raw, None);
        }
        (self.acquired, self.raw) = (vk::Fence::null(), vk::SwapchainKHR::null());
    }

    fn create(&mut self, info: &vk::SwapchainCreateInfoKHR<'_>) -> Result<(), vk::Result> {
        let device = &self.surface.device;
        // SAFETY: `info` is valid; everything is destroyed in Drop.
        unsafe {
            self.raw = self.loader.create_swapchain(info, None)?;
            self.images = self.loader.get_swapchain_images(self.raw)?;
            self.acquired = device
                .raw
                .create_fence(&vk::FenceCreateInfo::default(), None)?;
        }
        for &image in &self.images {
            let view = vk::ImageViewCreateInfo::default()
                .image(image)
                .view_type(vk::ImageViewType::TYPE_2D)
                .format(info.image_format)
                .subresource_range(COLOR);
            // SAFETY: the image belongs to the live swapchain; destroyed in Drop.
            self.views
                .push(unsafe { device.raw.create_image_view(&view, None) }?);
        }
        Ok(())
    }
}

impl Drop for Swapchain {
    fn drop(&mut self) {
        self.destroy();
    }
}

/// Enters the bytes of the images in the ledger.
fn reserve(memory: &Arc<Memory>, surface: &Surface, shape: Shape) -> Result<Holding> {
    let info = vk::ImageCreateInfo::default()
        .image_type(vk::ImageType::TYPE_2D)
        .format(surface.format.format)
        .extent(extent_2d(shape.extent).into())
        .mip_levels(1)
        .array_layers(1)
        .samples(vk::SampleCountFlags::TYPE_1)
        .tiling(vk::ImageTiling::OPTIMAL)
        .usage(USAGE);
    let query = vk::DeviceImageMemoryRequirements::default().create_info(&info);
    let mut requirements = vk::MemoryRequirements2::default();
    // SAFETY: the query describes a valid image; nothing is created.
    unsafe {
        memory
            .device()
            .raw
            .get_device_image_memory_requirements(&query, &mut requirements)
    };
    let mut all = requirements.memory_requirements;
    all.size *= shape.images as u64;
    memory.reserve("window: images", &all)
}

fn extent_2d([width, height]: [u32; 2]) -> vk::Extent2D {
    vk::Extent2D { width, height }
}
