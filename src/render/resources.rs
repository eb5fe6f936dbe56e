//! Every byte of GPU memory that rendering takes. Allocating through a dry-run gate gives the plan;
//! allocating through a real one gives the resources: the same statements, so the same sizes.

use std::sync::Arc;

use super::cache_resources::{CacheResources, pages_desc};
use super::constants::{SceneBuffers, volume_format};
use super::published_resources::PublishedResources;
use super::shared::{Counters, NodeWork, PATCHES, Path};
use crate::error::Result;
use crate::gpu::{
    Binding, Buffer, BufferDesc, DeviceSummary, Format, Image, ImageDesc, Memory, Placement,
};
use crate::scene::volume::Volume;

/// Copies between host and device go through a buffer of at most this size, piece by piece.
const MOST_STAGING_BYTES: u64 = 16 << 20;

/// Paths under way at once. A GPU hides latency with many; a CPU wants them in its cache.
const SLOTS_GPU: u32 = 1 << 18;
const SLOTS_CPU: u32 = 1 << 10;

pub struct Resources {
    /// Whether the device's filter reads the volume.
    filtered: bool,
    /// Pixels of the picture, which may be fewer than its images hold: those from the upper left corner.
    pub size: [u32; 2],
    pub volume: Image,
    /// Per macrocell: smallest and largest stored value.
    pub ranges: Image,
    /// Per cell, which may be larger than a macrocell: the largest extinction. It has room for the smallest
    /// ones, so that an edit of the medium needs no memory.
    pub majorants: Image,
    /// Two texels for each patch of the picture, and a row for all of it.
    pub patches: Image,
    pub scene: Buffer,
    pub transfer: Image,
    pub surfaces: Buffer,
    pub suns: Buffer,
    pub clips: Buffer,
    pub sky: Buffer,
    pub environment: Image,
    pub paths: Buffer,
    pub counters: Buffer,
    /// Per pixel, the sum of the samples of the unit under way; coverage in alpha.
    pub unit_sum: Image,
    pub mean: Image,
    /// Weighted sum of squared differences from the mean.
    pub squares: Image,
    /// What the pixels' centres see; only with surfaces.
    pub first_surface: Option<FirstSurface>,
    /// Only in the variant that has one.
    pub cache: Option<CacheResources>,
    /// Only in that variant.
    pub published: Option<PublishedResources>,
    pub staging: Buffer,
}

/// Of the first surface behind each pixel's centre.
pub struct FirstSurface {
    /// Normal and, in w, distance; +∞ where there is none.
    pub normal_depth: Image,
    pub albedo: Image,
}

impl Resources {
    pub fn allocate(
        memory: &Arc<Memory>,
        volume: &Volume,
        scene: &SceneBuffers,
    ) -> Result<Resources> {
        let [width, height] = scene.constants.size;
        let picture = |name| ImageDesc {
            name,
            extent: [width, height, 1],
            volumetric: false,
            written: true,
            format: Format::R32G32B32A32_SFLOAT,
        };
        let ranges = ImageDesc {
            name: "macrocell ranges",
            extent: scene.constants.macrocells,
            volumetric: true,
            written: false,
            format: Format::R32G32_SFLOAT,
        };
        let majorants = ImageDesc {
            name: "majorants",
            written: true,
            format: Format::R32_SFLOAT,
            ..ranges
        };
        let patches = ImageDesc {
            name: "patches",
            extent: [2 * PATCHES, PATCHES + 1, 1],
            volumetric: false,
            written: true,
            format: Format::R32_UINT,
        };
        let environment = ImageDesc {
            name: "environment image",
            extent: [scene.environment.width, scene.environment.height, 1],
            volumetric: false,
            written: false,
            format: Format::R32G32B32A32_SFLOAT,
        };
        let slots = slots(&memory.limits, [width, height]);
        Ok(Resources {
            filtered: !scene.features.filter_in_shader,
            size: scene.constants.size,
            volume: Image::new(memory, volume_desc(volume))?,
            ranges: Image::new(memory, ranges)?,
            majorants: Image::new(memory, majorants)?,
            patches: Image::new(memory, patches)?,
            scene: Buffer::with_data(memory, "scene constants", &[scene.constants])?,
            transfer: Image::new(memory, transfer_desc(scene.transfer.len()))?,
            surfaces: Buffer::with_data(memory, "surfaces", &scene.surfaces)?,
            suns: Buffer::with_data(memory, "suns", &scene.suns)?,
            clips: Buffer::with_data(memory, "clip planes", &scene.clips)?,
            sky: Buffer::with_data(memory, "environment table", &scene.sky)?,
            environment: Image::new(memory, environment)?,
            paths: Buffer::new(
                memory,
                BufferDesc {
                    name: "paths",
                    bytes: slots as u64 * size_of::<Path>() as u64,
                    placement: Placement::Device,
                },
            )?,
            counters: Buffer::new(
                memory,
                BufferDesc {
                    name: "counters",
                    bytes: size_of::<Counters>() as u64,
                    placement: Placement::Device,
                },
            )?,
            unit_sum: Image::new(memory, picture("unit sum"))?,
            mean: Image::new(memory, picture("mean"))?,
            squares: Image::new(memory, picture("squared differences"))?,
            first_surface: match scene.features.surface_count {
                0 => None,
                _ => Some(FirstSurface {
                    normal_depth: Image::new(memory, picture("normal and depth"))?,
                    albedo: Image::new(memory, picture("albedo"))?,
                }),
            },
            cache: match &scene.cache {
                None => None,
                Some(layout) => Some(CacheResources::allocate(memory, layout, scene, slots)?),
            },
            published: match scene.published {
                true => Some(PublishedResources::allocate(memory, volume.dims)?),
                false => None,
            },
            staging: Buffer::new(
                memory,
                BufferDesc {
                    name: "staging",
                    bytes: staging_bytes(&[
                        volume_desc(volume),
                        ranges,
                        transfer_desc(scene.transfer.len()),
                        scene.cache.as_ref().map_or(environment, pages_desc),
                        environment,
                        picture("mean"),
                    ]),
                    placement: Placement::Readback,
                },
            )?,
        })
    }

    /// Puts another scene of the same volume, sky image and features in the place of the one before.
    /// True if the cache is another one, of which nothing is known.
    pub fn write(&mut self, before: &SceneBuffers, scene: &SceneBuffers) -> Result<bool> {
        self.size = scene.constants.size;
        self.scene.rewrite(&[scene.constants])?;
        self.surfaces.rewrite(&scene.surfaces)?;
        self.suns.rewrite(&scene.suns)?;
        self.clips.rewrite(&scene.clips)?;
        match (&mut self.cache, &scene.cache) {
            (Some(cache), Some(layout)) if before.cache != scene.cache => {
                cache.lay_out(layout)?;
                self.resize_staging()?;
                Ok(true)
            }
            _ => Ok(false),
        }
    }

    /// Makes room for a transfer function of so many points.
    pub fn resize_transfer(&mut self, points: usize) -> Result<()> {
        self.transfer.resize(transfer_desc(points).extent)?;
        self.resize_staging()
    }

    /// Makes room for a picture of another size; what its images held is gone.
    pub fn resize(&mut self, [width, height]: [u32; 2]) -> Result<()> {
        let slots = slots(self.mean.limits(), [width, height]);
        self.paths.resize(slots as u64 * size_of::<Path>() as u64)?;
        if let Some(cache) = &mut self.cache {
            let bytes = slots as u64 * size_of::<NodeWork>() as u64;
            cache.work.resize(bytes)?;
        }
        for image in self.picture_mut() {
            image.resize([width, height, 1])?;
        }
        self.resize_staging()
    }

    fn resize_staging(&mut self) -> Result<()> {
        let pages = self.cache.as_ref().map(|cache| cache.pages.desc);
        let largest = [
            self.volume.desc,
            self.ranges.desc,
            self.transfer.desc,
            self.environment.desc,
            self.mean.desc,
            pages.unwrap_or(self.mean.desc),
        ];
        self.staging.resize(staging_bytes(&largest))
    }

    /// What has a texel for each pixel.
    pub fn picture(&self) -> Vec<&Image> {
        let surface = self.first_surface.iter();
        let surface = surface.flat_map(|s| [&s.normal_depth, &s.albedo]);
        let images = [&self.unit_sum, &self.mean, &self.squares];
        images.into_iter().chain(surface).collect()
    }

    fn picture_mut(&mut self) -> Vec<&mut Image> {
        let surface = self.first_surface.iter_mut();
        let surface = surface.flat_map(|s| [&mut s.normal_depth, &mut s.albedo]);
        let images = [&mut self.unit_sum, &mut self.mean, &mut self.squares];
        images.into_iter().chain(surface).collect()
    }

    /// Those that are filled from outside, or by the pass that writes them.
    pub fn images_to_fill(&self) -> Vec<&Image> {
        let mut images = vec![
            &self.volume,
            &self.ranges,
            &self.majorants,
            &self.transfer,
            &self.environment,
        ];
        images.extend(self.cache.iter().map(|cache| &cache.pages));
        images
    }

    /// Those that are read before all of their texels are written.
    pub fn images_from_zero(&self) -> Vec<&Image> {
        let mut images = self.picture();
        images.push(&self.patches);
        images.extend(self.cache.iter().flat_map(CacheResources::images));
        images.extend(self.published.iter().flat_map(PublishedResources::images));
        images
    }

    pub fn volume_binding(&self) -> Binding<'_> {
        match self.filtered {
            true => Binding::Filtered(&self.volume),
            false => Binding::Image(&self.volume),
        }
    }

    /// What seeing the medium takes.
    pub fn medium_bindings(&self) -> [(&'static str, Binding<'_>); 8] {
        [
            ("scene_block", Binding::Buffer(&self.scene)),
            ("volume", self.volume_binding()),
            ("transfer", Binding::Image(&self.transfer)),
            ("clips", Binding::Buffer(&self.clips)),
            ("majorants", Binding::Image(&self.majorants)),
            ("suns", Binding::Buffer(&self.suns)),
            ("environment", Binding::Image(&self.environment)),
            ("sky", Binding::Buffer(&self.sky)),
        ]
    }

    /// What surfaces take besides that.
    pub fn surface_bindings(&self) -> [(&'static str, Binding<'_>); 2] {
        [
            ("ranges", Binding::Image(&self.ranges)),
            ("surfaces", Binding::Buffer(&self.surfaces)),
        ]
    }

    /// What rays from the camera take.
    pub fn camera_binding(&self) -> (&'static str, Binding<'_>) {
        ("patches", Binding::Image(&self.patches))
    }

    /// What paths take besides both.
    pub fn path_bindings(&self) -> [(&'static str, Binding<'_>); 2] {
        [
            ("paths", Binding::Buffer(&self.paths)),
            ("counters", Binding::Buffer(&self.counters)),
        ]
    }

    pub fn slots(&self) -> u32 {
        (self.paths.desc.bytes / size_of::<Path>() as u64) as u32
    }
}

/// Enough for the largest image at once, within reason.
fn staging_bytes(images: &[ImageDesc]) -> u64 {
    let largest = images.iter().map(ImageDesc::bytes).max().unwrap_or(0);
    largest.min(MOST_STAGING_BYTES)
}

fn slots(limits: &DeviceSummary, [width, height]: [u32; 2]) -> u32 {
    let most = match limits.kind {
        "CPU" => SLOTS_CPU,
        _ => SLOTS_GPU,
    };
    let pixels = width as u64 * height as u64;
    pixels.next_multiple_of(64).min(most as u64) as u32
}

/// A column for each point of the transfer function, and one more.
fn transfer_desc(points: usize) -> ImageDesc {
    ImageDesc {
        name: "transfer function",
        extent: [points as u32 + 1, 2, 1],
        volumetric: false,
        written: false,
        format: Format::R32G32B32A32_SFLOAT,
    }
}

/// The volume's image, in the data's own width.
fn volume_desc(volume: &Volume) -> ImageDesc {
    ImageDesc {
        name: "volume",
        extent: volume.dims,
        volumetric: true,
        written: false,
        format: volume_format(volume),
    }
}
