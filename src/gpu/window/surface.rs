//! A window's surface and the images that it shows.
//!
//! Images are acquired with a fence and shown after the frame's own fence, so that no semaphore is needed: an image
//! is never shown before the frame that drew it has ended. The driver allocates them; the ledger counts the bytes
//! that images of that kind take.

use std::any::Any;
use std::ffi::CStr;
use std::fmt::Display;
use std::sync::Arc;

use ash::{khr, vk};
use winit::raw_window_handle::{HasDisplayHandle, HasWindowHandle, RawDisplayHandle};

use super::super::device::{Device, DeviceChoice};
use super::super::failure::failure;
use super::super::image::COLOR;
use super::super::instance::Instance;
use super::super::memory::{Holding, Memory};
use crate::error::{DeviceError, Error, Result};

/// Eight bits for each channel, already encoded for display when they are written.
const FORMATS: [vk::Format; 2] = [vk::Format::B8G8R8A8_UNORM, vk::Format::R8G8B8A8_UNORM];

impl Device {
    /// Opens the wanted device, or the best, for the windows of a display.
    pub fn open_for_display(
        choice: &DeviceChoice,
        display: RawDisplayHandle,
    ) -> Result<Arc<Device>> {
        let extensions = ash_window::enumerate_required_extensions(display).map_err(|e| {
            DeviceError::Display(format!("Vulkan knows no way to draw on this display: {e}"))
        })?;
        // SAFETY: these are names of extensions as constants of the library have them.
        let extensions: Vec<&'static CStr> = extensions
            .iter()
            .map(|&name| unsafe { CStr::from_ptr(name) })
            .collect();
        let instance = Instance::new(choice.validation, &extensions)?;
        Device::open_from(instance, choice, true)
    }
}

/// The side of the window system; it lives as long as the window.
pub struct Surface {
    pub(in crate::gpu) device: Arc<Device>,
    loader: khr::surface::Instance,
    raw: vk::SurfaceKHR,
    pub(in crate::gpu) format: vk::SurfaceFormatKHR,
    // Last: the window goes after its surface.
    _window: Arc<dyn Any + Send + Sync>,
}

impl Surface {
    pub fn new<W>(device: &Arc<Device>, window: Arc<W>) -> Result<Arc<Surface>>
    where
        W: HasDisplayHandle + HasWindowHandle + Send + Sync + 'static,
    {
        let display = window.display_handle();
        let display = display.map_err(|e| shows_nothing(device, e))?.as_raw();
        let handle = window.window_handle();
        let handle = handle.map_err(|e| shows_nothing(device, e))?.as_raw();
        let instance = &device.instance;
        // SAFETY: the handles belong to the live window, which the surface keeps alive.
        let raw = unsafe {
            ash_window::create_surface(&instance.entry, &instance.raw, display, handle, None)
        };
        let mut surface = Surface {
            device: device.clone(),
            loader: khr::surface::Instance::new(&instance.entry, &instance.raw),
            raw: raw.map_err(|e| failed(device, e))?,
            format: vk::SurfaceFormatKHR::default(),
            _window: window,
        };
        surface.format = surface.choose_format()?;
        Ok(Arc::new(surface))
    }

    fn choose_format(&self) -> Result<vk::SurfaceFormatKHR> {
        let physical = self.device.physical;
        // SAFETY: surface and device are alive.
        let (shows, formats) = unsafe {
            let family = self.device.queue_family;
            let loader = &self.loader;
            (
                loader.get_physical_device_surface_support(physical, family, self.raw),
                loader.get_physical_device_surface_formats(physical, self.raw),
            )
        };
        if !shows.map_err(|e| failed(&self.device, e))? {
            let why = "its compute queue does not reach this display";
            return Err(shows_nothing(&self.device, why));
        }
        let usage = self.capabilities()?.supported_usage_flags;
        if !usage.contains(USAGE) {
            let why = "its images cannot be both copied to and drawn on";
            return Err(shows_nothing(&self.device, why));
        }
        let formats = formats.map_err(|e| failed(&self.device, e))?;
        let found = formats.iter().find(|f| FORMATS.contains(&f.format));
        found
            .copied()
            .ok_or_else(|| shows_nothing(&self.device, "it has no format of eight bits a channel"))
    }

    /// The shape that the window's images must have now; it may change at any moment. `wanted` is the size in pixels
    /// that is used where the window system leaves it to the program.
    pub fn shape(&self, wanted: [u32; 2]) -> Result<Shape> {
        let capabilities = self.capabilities()?;
        let extent = match capabilities.current_extent {
            vk::Extent2D {
                width: u32::MAX, ..
            } => {
                let least = capabilities.min_image_extent;
                let most = capabilities.max_image_extent;
                let [width, height] = wanted;
                [
                    width.clamp(least.width, most.width.max(least.width)),
                    height.clamp(least.height, most.height.max(least.height)),
                ]
            }
            vk::Extent2D { width, height } => [width, height],
        };
        let least = capabilities.min_image_count.max(2);
        Ok(Shape {
            extent: extent.map(|n| n.max(1)),
            images: match capabilities.max_image_count {
                0 => least,
                most => least.min(most),
            },
            transform: capabilities.current_transform,
            alpha: composite_alpha(capabilities.supported_composite_alpha),
        })
    }

    fn capabilities(&self) -> Result<vk::SurfaceCapabilitiesKHR> {
        // SAFETY: surface and device are alive.
        let capabilities = unsafe {
            self.loader
                .get_physical_device_surface_capabilities(self.device.physical, self.raw)
        };
        capabilities.map_err(|e| failed(&self.device, e))
    }
}

impl Drop for Surface {
    fn drop(&mut self) {
        // SAFETY: swapchains hold the surface, so none is left.
        unsafe { self.loader.destroy_surface(self.raw, None) };
    }
}

/// Size and other properties of a window's images.
#[derive(Clone, Copy)]
pub struct Shape {
    /// In pixels.
    pub extent: [u32; 2],
    /// Number of images: first as many as are asked for, then as many as the driver has made.
    pub images: u32,
    pub(super) transform: vk::SurfaceTransformFlagsKHR,
    alpha: vk::CompositeAlphaFlagsKHR,
}

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
            .surface(surface.raw)
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

const USAGE: vk::ImageUsageFlags = vk::ImageUsageFlags::from_raw(
    vk::ImageUsageFlags::COLOR_ATTACHMENT.as_raw() | vk::ImageUsageFlags::TRANSFER_DST.as_raw(),
);

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
    memory.reserve("window images", &all)
}

fn extent_2d([width, height]: [u32; 2]) -> vk::Extent2D {
    vk::Extent2D { width, height }
}

/// What the window system does with alpha, which is 1 everywhere: a surface supports at least one of all ways.
fn composite_alpha(supported: vk::CompositeAlphaFlagsKHR) -> vk::CompositeAlphaFlagsKHR {
    let ways = [
        vk::CompositeAlphaFlagsKHR::OPAQUE,
        vk::CompositeAlphaFlagsKHR::INHERIT,
        vk::CompositeAlphaFlagsKHR::PRE_MULTIPLIED,
        vk::CompositeAlphaFlagsKHR::POST_MULTIPLIED,
    ];
    let supported = ways.into_iter().find(|way| supported.contains(*way));
    supported.unwrap_or(vk::CompositeAlphaFlagsKHR::OPAQUE)
}

fn shows_nothing(device: &Device, why: impl Display) -> Error {
    let problem = format!("cannot show anything in a window: {why}");
    DeviceError::ShowsNothing {
        device: device.summary.name.clone(),
        problem,
    }
    .into()
}

pub(super) fn failed(device: &Device, error: vk::Result) -> Error {
    failure(
        error,
        format!("{} failed at the window", device.summary.name),
    )
}
