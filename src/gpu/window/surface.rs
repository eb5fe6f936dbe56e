//! The side of the window system: a window's surface, and which devices can show pictures on it.
//!
//! A surface comes before its device, since on a machine with several not each may reach each display: the device is
//! chosen among those that do.

use std::any::Any;
use std::ffi::CStr;
use std::fmt::Display;
use std::sync::Arc;

use ash::{khr, vk};
use winit::raw_window_handle::{HasDisplayHandle, HasWindowHandle};

use super::super::device::{Device, DeviceChoice};
use super::super::failure::failure;
use super::super::instance::Instance;
use crate::error::{DeviceError, Error, Result};

/// Eight bits for each channel, already encoded for display when they are written.
const FORMATS: [vk::Format; 2] = [vk::Format::B8G8R8A8_UNORM, vk::Format::R8G8B8A8_UNORM];

pub(super) const USAGE: vk::ImageUsageFlags = vk::ImageUsageFlags::from_raw(
    vk::ImageUsageFlags::COLOR_ATTACHMENT.as_raw() | vk::ImageUsageFlags::TRANSFER_DST.as_raw(),
);

/// A window's surface, for which a device is yet to be chosen. It lives as long as the window.
struct NativeSurface {
    instance: Arc<Instance>,
    loader: khr::surface::Instance,
    raw: vk::SurfaceKHR,
    // Last: the window goes after its surface.
    _window: Arc<dyn Any + Send + Sync>,
}

impl NativeSurface {
    fn new<W>(choice: &DeviceChoice, window: Arc<W>) -> Result<NativeSurface>
    where
        W: HasDisplayHandle + HasWindowHandle + Send + Sync + 'static,
    {
        let display = window.display_handle().map_err(no_window)?.as_raw();
        let handle = window.window_handle().map_err(no_window)?.as_raw();
        let extensions = ash_window::enumerate_required_extensions(display).map_err(|e| {
            DeviceError::Display(format!("Vulkan knows no way to draw on this display: {e}"))
        })?;
        // SAFETY: these are names of extensions as constants of the library have them.
        let extensions: Vec<&'static CStr> = extensions
            .iter()
            .map(|&name| unsafe { CStr::from_ptr(name) })
            .collect();
        let instance = Arc::new(Instance::new(choice.validation, &extensions)?);
        // SAFETY: the handles belong to the live window, which the surface keeps alive.
        let raw = unsafe {
            ash_window::create_surface(&instance.entry, &instance.raw, display, handle, None)
        };
        Ok(NativeSurface {
            loader: khr::surface::Instance::new(&instance.entry, &instance.raw),
            raw: raw.map_err(|e| failure(e, "Vulkan could not draw on the window"))?,
            instance,
            _window: window,
        })
    }

    /// The format of the images that a queue of a device can show here; what it lacks, if it cannot.
    fn format_on(
        &self,
        physical: vk::PhysicalDevice,
        queue_family: u32,
    ) -> Result<vk::SurfaceFormatKHR, String> {
        // SAFETY: the surface is alive, and `physical` belongs to its instance.
        let (shows, formats) = unsafe {
            let (loader, surface) = (&self.loader, self.raw);
            (
                loader.get_physical_device_surface_support(physical, queue_family, surface),
                loader.get_physical_device_surface_formats(physical, surface),
            )
        };
        let unable = |why: &dyn Display| format!("cannot show anything in a window: {why}");
        if !shows.map_err(|e| unable(&e))? {
            return Err(unable(&"its compute queue does not reach this display"));
        }
        let capabilities = self.capabilities(physical).map_err(|e| unable(&e))?;
        if !capabilities.supported_usage_flags.contains(USAGE) {
            return Err(unable(&"its images cannot be both copied to and drawn on"));
        }
        let formats = formats.map_err(|e| unable(&e))?;
        let found = formats.iter().find(|f| FORMATS.contains(&f.format));
        found
            .copied()
            .ok_or_else(|| unable(&"it has no format of eight bits a channel"))
    }

    fn capabilities(
        &self,
        physical: vk::PhysicalDevice,
    ) -> Result<vk::SurfaceCapabilitiesKHR, vk::Result> {
        // SAFETY: the surface is alive, and `physical` belongs to its instance.
        unsafe {
            self.loader
                .get_physical_device_surface_capabilities(physical, self.raw)
        }
    }
}

impl Drop for NativeSurface {
    fn drop(&mut self) {
        // SAFETY: swapchains hold the surface, so none is left, and the instance is alive.
        unsafe { self.loader.destroy_surface(self.raw, None) };
    }
}

/// A window's surface, on the device that draws for it.
pub struct Surface {
    native: NativeSurface,
    pub(in crate::gpu) device: Arc<Device>,
    pub(in crate::gpu) format: vk::SurfaceFormatKHR,
}

impl Surface {
    /// The surface of a window, on the wanted device, or on the best that can draw there.
    pub fn open<W>(choice: &DeviceChoice, window: Arc<W>) -> Result<Arc<Surface>>
    where
        W: HasDisplayHandle + HasWindowHandle + Send + Sync + 'static,
    {
        let native = NativeSurface::new(choice, window)?;
        let can_show = |physical, family| native.format_on(physical, family).map(drop);
        let device = Device::open_from(native.instance.clone(), choice, Some(&can_show))?;
        let format = native.format_on(device.physical, device.queue_family);
        Ok(Arc::new(Surface {
            format: format.map_err(|problem| DeviceError::ShowsNothing {
                device: device.summary.name.clone(),
                problem,
            })?,
            native,
            device,
        }))
    }

    pub fn device(&self) -> &Arc<Device> {
        &self.device
    }

    pub(super) fn raw(&self) -> vk::SurfaceKHR {
        self.native.raw
    }

    /// The shape that the window's images must have now; it may change at any moment. `wanted` is the size in pixels
    /// that is used where the window system leaves it to the program.
    pub fn shape(&self, wanted: [u32; 2]) -> Result<Shape> {
        let capabilities = self.native.capabilities(self.device.physical);
        let capabilities = capabilities.map_err(|e| failed(&self.device, e))?;
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
}

/// Size and other properties of a window's images.
#[derive(Clone, Copy)]
pub struct Shape {
    /// In pixels.
    pub extent: [u32; 2],
    /// Number of images: first as many as are asked for, then as many as the driver has made.
    pub images: u32,
    pub(super) transform: vk::SurfaceTransformFlagsKHR,
    pub(super) alpha: vk::CompositeAlphaFlagsKHR,
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

fn no_window(why: impl Display) -> Error {
    DeviceError::Display(format!("the window cannot be drawn on: {why}")).into()
}

pub(super) fn failed(device: &Device, error: vk::Result) -> Error {
    failure(
        error,
        format!("{} failed at the window", device.summary.name),
    )
}
