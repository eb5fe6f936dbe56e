//! 2D and 3D images with one view over all of them, always in the GENERAL layout.
//!
//! A new image is in the layout UNDEFINED, and so are its texels. The first command that uses it brings it into the GENERAL
//! layout and, where its description says so, clears it: there is no list of images to begin.

use std::cell::Cell;
use std::sync::Arc;

use ash::vk;
use gpu_allocator::MemoryLocation;

use super::failure::failure;
use super::memory::{Holding, Memory, Owner};
use super::survey::DeviceSummary;
use crate::error::{MemoryError, Result};

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct ImageDesc {
    pub name: &'static str,
    /// In texels; a depth of 1 still makes a 3D image if `volumetric`.
    pub extent: [u32; 3],
    pub volumetric: bool,
    /// Whether shaders write it, as a storage image.
    pub written: bool,
    /// Whether its texels are zero when it is first used. Otherwise they are undefined, and no shader may make use of a texel
    /// before a command has written it.
    pub zeroed: bool,
    pub format: vk::Format,
}

/// An image that can be a sampled image and source and destination of copies, and also a storage image if it is
/// `written` or if the device reads images in that way. One thread at a time uses it.
pub struct Image {
    raw: vk::Image,
    view: vk::ImageView,
    pub(super) desc: ImageDesc,
    /// Whether no submission that has ended well has used it.
    is_new: Cell<bool>,
    // Last: the memory goes after the image.
    holding: Holding,
}

fn texels(extent: [u32; 3]) -> u64 {
    extent.iter().map(|&n| u64::from(n)).product()
}

impl ImageDesc {
    /// A 2D image that no shader writes, and whose texels are undefined at first.
    pub const fn flat(name: &'static str, size: [u32; 2], format: vk::Format) -> ImageDesc {
        let [width, height] = size;
        ImageDesc {
            volumetric: false,
            ..ImageDesc::volumetric(name, [width, height, 1], format)
        }
    }

    /// A 3D image that no shader writes, and whose texels are undefined at first.
    pub const fn volumetric(name: &'static str, extent: [u32; 3], format: vk::Format) -> ImageDesc {
        ImageDesc {
            name,
            extent,
            volumetric: true,
            written: false,
            zeroed: false,
            format,
        }
    }

    /// The same, but shaders write it.
    pub const fn written(self) -> ImageDesc {
        ImageDesc {
            written: true,
            ..self
        }
    }

    /// The same, but its texels are zero at first.
    pub const fn zeroed(self) -> ImageDesc {
        ImageDesc {
            zeroed: true,
            ..self
        }
    }

    /// `loads_texels`: whether shaders read it as a storage image, too.
    fn info(&self, loads_texels: bool) -> vk::ImageCreateInfo<'static> {
        let [width, height, depth] = self.extent;
        vk::ImageCreateInfo::default()
            .image_type(if self.volumetric {
                vk::ImageType::TYPE_3D
            } else {
                vk::ImageType::TYPE_2D
            })
            .format(self.format)
            .extent(vk::Extent3D {
                width,
                height,
                depth,
            })
            .mip_levels(1)
            .array_layers(1)
            .samples(vk::SampleCountFlags::TYPE_1)
            .tiling(vk::ImageTiling::OPTIMAL)
            .usage(
                (if self.written || loads_texels {
                    vk::ImageUsageFlags::STORAGE
                } else {
                    vk::ImageUsageFlags::empty()
                }) | vk::ImageUsageFlags::SAMPLED
                    | vk::ImageUsageFlags::TRANSFER_SRC
                    | vk::ImageUsageFlags::TRANSFER_DST,
            )
    }

    fn check_size(&self, limits: &DeviceSummary) -> Result<()> {
        let most = if self.volumetric {
            limits.max_image_3d
        } else {
            limits.max_image_2d
        };
        match self.extent.iter().max() {
            Some(&longest) if longest > most => Err(MemoryError::Image {
                resource: self.name.into(),
                texels: longest,
                device: limits.name.clone(),
                limit: most,
            }
            .into()),
            _ => Ok(()),
        }
    }

    /// How many texels there are.
    pub fn texels(&self) -> u64 {
        texels(self.extent)
    }

    /// Bytes of all texels, without a device's padding.
    pub fn bytes(&self) -> u64 {
        self.bytes_of(self.extent)
    }

    /// The same of a box of texels.
    pub fn bytes_of(&self, extent: [u32; 3]) -> u64 {
        texels(extent) * self.texel_bytes() as u64
    }

    /// Bytes of one texel.
    pub fn texel_bytes(&self) -> usize {
        match self.format {
            vk::Format::R8_UNORM => 1,
            vk::Format::R16_UNORM => 2,
            vk::Format::R32_SFLOAT | vk::Format::R32_UINT | vk::Format::R8G8B8A8_UNORM => 4,
            vk::Format::R32G32_SFLOAT | vk::Format::R16G16B16A16_SFLOAT => 8,
            vk::Format::R32G32B32A32_SFLOAT => 16,
            other => unreachable!("{other:?} is not used"),
        }
    }
}

impl Image {
    pub fn new(memory: &Arc<Memory>, desc: ImageDesc) -> Result<Image> {
        let device = &memory.device;
        desc.check_size(&memory.limits)?;
        let info = desc.info(device.loads_texels);
        let query = vk::DeviceImageMemoryRequirements::default().create_info(&info);
        let mut requirements = vk::MemoryRequirements2::default();
        // SAFETY: the query describes a valid image; nothing is created.
        unsafe {
            device
                .raw
                .get_device_image_memory_requirements(&query, &mut requirements)
        };
        let requirements = requirements.memory_requirements;
        let mut image = Image {
            raw: vk::Image::null(),
            view: vk::ImageView::null(),
            desc,
            is_new: Cell::new(true),
            holding: memory.reserve(desc.name, &requirements)?,
        };
        if memory.is_dry_run() {
            return Ok(image);
        }
        let failed = |e: vk::Result| failure(e, format!("image {} could not be made", desc.name));
        // SAFETY: `info` is valid; the image is destroyed in Drop.
        image.raw = unsafe { device.raw.create_image(&info, None) }.map_err(failed)?;
        let owner = Owner::Image(image.raw);
        let allocation = image
            .holding
            .allocate(requirements, MemoryLocation::GpuOnly, owner)?;
        // SAFETY: the allocation is dedicated to this image and lives as long as it.
        unsafe {
            device
                .raw
                .bind_image_memory(image.raw, allocation.memory(), allocation.offset())
        }
        .map_err(failed)?;
        let view = vk::ImageViewCreateInfo::default()
            .image(image.raw)
            .view_type(if desc.volumetric {
                vk::ImageViewType::TYPE_3D
            } else {
                vk::ImageViewType::TYPE_2D
            })
            .format(desc.format)
            .subresource_range(COLOR);
        // SAFETY: the image is bound; the view is destroyed in Drop.
        image.view = unsafe { device.raw.create_image_view(&view, None) }.map_err(failed)?;
        Ok(image)
    }

    /// Changes the extent; the texels are lost. The old memory is freed first, so that both together are never
    /// needed: after an error the image has no memory, and may only be resized or dropped.
    pub fn resize(&mut self, extent: [u32; 3]) -> Result<()> {
        let desc = ImageDesc {
            extent,
            ..self.desc
        };
        let memory = self.holding.memory();
        self.destroy();
        *self = Image::new(&memory, desc)?;
        Ok(())
    }

    /// The handle for a command. An image without memory, since a dry run has made it or it could not be resized, has none.
    pub(super) fn handle(&self) -> vk::Image {
        let name = self.desc.name;
        assert!(self.raw != vk::Image::null(), "{name} has no memory");
        self.raw
    }

    /// The view for a descriptor, of an image that has memory.
    pub(super) fn view(&self) -> vk::ImageView {
        let name = self.desc.name;
        assert!(self.view != vk::ImageView::null(), "{name} has no memory");
        self.view
    }

    /// Whether its layout and its texels are still undefined.
    pub(super) fn is_new(&self) -> bool {
        self.is_new.get()
    }

    /// Notes that a submission has begun it.
    pub(super) fn note_begun(&self) {
        self.is_new.set(false);
    }

    pub fn desc(&self) -> &ImageDesc {
        &self.desc
    }

    /// The limits of the device that the image is on.
    pub fn limits(&self) -> &DeviceSummary {
        &self.holding.device().summary
    }

    fn destroy(&mut self) {
        let device = &self.holding.device().raw;
        // SAFETY: a recording borrows the image until its work has ended, so nothing uses it.
        unsafe {
            device.destroy_image_view(self.view, None);
            device.destroy_image(self.raw, None);
        }
        (self.view, self.raw) = (vk::ImageView::null(), vk::Image::null());
        self.desc.extent = [0; 3];
        self.holding.release();
    }
}

/// All of an image, as views and barriers name it.
pub(super) const COLOR: vk::ImageSubresourceRange = vk::ImageSubresourceRange {
    aspect_mask: vk::ImageAspectFlags::COLOR,
    base_mip_level: 0,
    level_count: 1,
    base_array_layer: 0,
    layer_count: 1,
};

/// All of an image, as copies name it.
pub(super) const COLOR_LAYER: vk::ImageSubresourceLayers = vk::ImageSubresourceLayers {
    aspect_mask: vk::ImageAspectFlags::COLOR,
    mip_level: 0,
    base_array_layer: 0,
    layer_count: 1,
};

impl Drop for Image {
    fn drop(&mut self) {
        self.destroy();
    }
}
