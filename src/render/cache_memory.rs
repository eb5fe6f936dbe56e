//! The cache's share of GPU memory.

use std::sync::Arc;

use super::cache_layout::CacheLayout;
use super::constants::SceneBuffers;
use super::shared::{Brick, NodeWork};
use crate::error::Result;
use crate::gpu::{Binding, Buffer, BufferDesc, Format, Image, ImageDesc, Memory, Placement};

/// The cache: its nodes' light, and where to find it.
pub struct CacheResources {
    /// Light without the suns' own; in alpha, the suns' share.
    pub light: Image,
    /// Only in an anisotropic medium.
    pub flux: Option<Image>,
    /// For each brick of the lattice, its place in the images.
    pub pages: Image,
    /// For each place, its brick.
    bricks: Buffer,
    pub active_bricks: u32,
    pub active_nodes: u64,
    /// For each place, a bit a cell; only where surfaces stop light.
    pub cuts: Option<Buffer>,
    /// What the slots are working on.
    pub work: Buffer,
}

impl CacheResources {
    pub(super) fn allocate(
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
            bricks: Buffer::with_data_in(
                memory,
                "cache: bricks",
                Placement::Readback,
                &bricks(layout),
            )?,
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
    pub(super) fn lay_out(&mut self, layout: &CacheLayout) -> Result<()> {
        self.light.resize(layout.extent())?;
        if let Some(flux) = &mut self.flux {
            flux.resize(layout.extent())?;
        }
        self.pages.resize(pages_desc(layout).extent)?;
        self.bricks.rewrite(&bricks(layout))?;
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

    /// In order of their places.
    pub fn bricks(&self) -> &[Brick] {
        bytemuck::cast_slice(self.bricks.mapped().unwrap_or_default())
    }

    pub fn bricks_mut(&mut self) -> &mut [Brick] {
        bytemuck::cast_slice_mut(self.bricks.mapped_mut().unwrap_or_default())
    }

    /// What filling the cache and weighing its bricks take besides reading it.
    pub fn brick_binding(&self) -> (&'static str, Binding<'_>) {
        ("bricks", Binding::Buffer(&self.bricks))
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

    /// What stays when the cache is filled.
    pub fn bytes(&self) -> u64 {
        let images = self.images().map(|i| i.desc.bytes());
        let cuts = self.cuts.as_ref().map_or(0, |b| b.desc.bytes);
        images.sum::<u64>() + self.pages.desc.bytes() + self.bricks.desc.bytes + cuts
    }
}

/// Those that have memory, none of which has had a path.
fn bricks(layout: &CacheLayout) -> Vec<Brick> {
    let brick = |&position: &u32| Brick {
        position,
        samples: 0,
        first_sample: 0,
        weight: 0,
    };
    layout.active.iter().map(brick).collect()
}

/// A texel for each brick of the cache's lattice.
pub(super) fn pages_desc(layout: &CacheLayout) -> ImageDesc {
    ImageDesc {
        name: "cache: pages",
        extent: layout.bricks,
        volumetric: true,
        written: false,
        format: Format::R32_UINT,
    }
}

/// A bit for each cell that has memory.
fn cut_bytes(layout: &CacheLayout) -> u64 {
    let cells = layout.extent().iter().map(|&n| n as u64).product::<u64>();
    cells / 8
}
