//! Every byte of GPU memory that rendering takes. Allocating through a dry-run gate gives the plan;
//! allocating through a real one gives the resources: the same statements, so the same sizes.

use std::sync::Arc;

use super::cache_layout::CacheLayout;
use super::constants::{SceneBuffers, volume_format};
use super::shared::{Counters, NodeWork, Path};
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
    /// Per macrocell: the largest extinction.
    pub majorants: Image,
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

/// The cache: its nodes' light, and where to find it.
pub struct CacheResources {
    /// Light without the suns' own; in alpha, the suns' share.
    pub light: Image,
    /// Only in an anisotropic medium.
    pub flux: Option<Image>,
    /// For each brick of the lattice, its place in the images.
    pub pages: Image,
    /// For each place, its brick.
    pub bricks: Buffer,
    pub active_bricks: u32,
    pub active_nodes: u64,
    /// For each place, a bit a cell; only where surfaces stop light.
    pub cuts: Option<Buffer>,
    /// What the slots are working on.
    pub work: Buffer,
}

/// The published baseline's cells, one a voxel: 14 floats each.
pub struct PublishedResources {
    /// Mean over paths and, in alpha, their number.
    pub radiance: Image,
    /// Of the path under way: position and number of bounces.
    pub position: Image,
    /// Its direction and the red of its throughput.
    pub direction: Image,
    /// The rest of its throughput.
    pub throughput: Image,
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
        let lattice = |name, format| ImageDesc {
            name,
            extent: scene.constants.macrocells,
            volumetric: true,
            written: true,
            format,
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
            ranges: Image::new(memory, lattice("macrocell ranges", Format::R32G32_SFLOAT))?,
            majorants: Image::new(memory, lattice("majorants", Format::R32_SFLOAT))?,
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

impl CacheResources {
    fn allocate(
        memory: &Arc<Memory>,
        layout: &CacheLayout,
        scene: &SceneBuffers,
        slots: u32,
    ) -> Result<CacheResources> {
        let nodes = |name| ImageDesc {
            name,
            extent: layout.extent(),
            volumetric: true,
            written: true,
            format: match layout.is_f16 {
                true => Format::R16G16B16A16_SFLOAT,
                false => Format::R32G32B32A32_SFLOAT,
            },
        };
        let on_device = |name, bytes| BufferDesc {
            name,
            bytes,
            placement: Placement::Device,
        };
        let cuts = || Buffer::new(memory, on_device("cut cells", cut_bytes(layout)));
        Ok(CacheResources {
            light: Image::new(memory, nodes("cache: light"))?,
            flux: match scene.features.is_anisotropic {
                true => Some(Image::new(memory, nodes("cache: flux"))?),
                false => None,
            },
            pages: Image::new(memory, pages_desc(layout))?,
            bricks: Buffer::with_data(memory, "cache: bricks", &layout.active)?,
            active_bricks: layout.active.len() as u32,
            active_nodes: layout.active_nodes(),
            cuts: match scene.features.full_light {
                true => Some(cuts()?),
                false => None,
            },
            work: Buffer::new(
                memory,
                on_device("cache: work", slots as u64 * size_of::<NodeWork>() as u64),
            )?,
        })
    }

    /// Takes another layout of the same format; what the images held is gone.
    fn lay_out(&mut self, layout: &CacheLayout) -> Result<()> {
        self.light.resize(layout.extent())?;
        if let Some(flux) = &mut self.flux {
            flux.resize(layout.extent())?;
        }
        self.pages.resize(pages_desc(layout).extent)?;
        self.bricks.rewrite(&layout.active)?;
        if let Some(cuts) = &mut self.cuts {
            cuts.resize(cut_bytes(layout))?;
        }
        self.active_bricks = layout.active.len() as u32;
        self.active_nodes = layout.active_nodes();
        Ok(())
    }

    pub fn images(&self) -> impl Iterator<Item = &Image> {
        std::iter::once(&self.light).chain(&self.flux)
    }

    /// What reading the cache takes. What a scene does without is bound to something that is there.
    pub fn bindings(&self) -> [(&'static str, Binding<'_>); 4] {
        [
            ("cache_light", Binding::Image(&self.light)),
            (
                "cache_flux",
                Binding::Image(self.flux.as_ref().unwrap_or(&self.light)),
            ),
            ("pages", Binding::Image(&self.pages)),
            (
                "cuts",
                Binding::Buffer(self.cuts.as_ref().unwrap_or(&self.bricks)),
            ),
        ]
    }

    /// At rest: what the picture needs.
    pub fn bytes(&self) -> u64 {
        let images = self.images().map(|i| i.desc.bytes());
        let cuts = self.cuts.as_ref().map_or(0, |b| b.desc.bytes);
        images.sum::<u64>() + self.pages.desc.bytes() + self.bricks.desc.bytes + cuts
    }
}

impl PublishedResources {
    fn allocate(memory: &Arc<Memory>, dims: [u32; 3]) -> Result<PublishedResources> {
        let cells = |name, format| {
            let desc = ImageDesc {
                name,
                extent: dims,
                volumetric: true,
                written: true,
                format,
            };
            Image::new(memory, desc)
        };
        Ok(PublishedResources {
            radiance: cells("published: radiance", Format::R32G32B32A32_SFLOAT)?,
            position: cells("published: position", Format::R32G32B32A32_SFLOAT)?,
            direction: cells("published: direction", Format::R32G32B32A32_SFLOAT)?,
            throughput: cells("published: throughput", Format::R32G32_SFLOAT)?,
        })
    }

    pub fn images(&self) -> [&Image; 4] {
        [
            &self.radiance,
            &self.position,
            &self.direction,
            &self.throughput,
        ]
    }

    /// Cells.
    pub fn count(&self) -> u64 {
        self.radiance
            .desc
            .extent
            .iter()
            .map(|&n| n as u64)
            .product()
    }

    pub fn bytes(&self) -> u64 {
        self.images().iter().map(|i| i.desc.bytes()).sum()
    }
}

/// A bit for each cell that has memory.
fn cut_bytes(layout: &CacheLayout) -> u64 {
    let cells = layout.extent().iter().map(|&n| n as u64).product::<u64>();
    cells / 8
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

/// A texel for each brick of the cache's lattice.
fn pages_desc(layout: &CacheLayout) -> ImageDesc {
    ImageDesc {
        name: "cache: pages",
        extent: layout.bricks,
        volumetric: true,
        written: false,
        format: Format::R32_UINT,
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
