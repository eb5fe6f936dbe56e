//! The GPU memory that only the caching variant takes.

use std::sync::Arc;

use super::brick_records::BrickRecords;
use super::marched::MarchedLookups;
use super::work_memory::WorkMemory;
use crate::error::Result;
use crate::gpu::{Binding, Buffer, BufferDesc, Format, Frame, Image, ImageDesc, Memory};
use crate::render::copy;
use crate::render::features::Features;
use crate::render::gpu_scene::GpuScene;
use crate::render::layout::CacheLayout;
use crate::render::resources::{bytes_of, slots};
use crate::render::shared::{
    BRICK, Brick, CUT_WORDS, REFLECTANCE_ANGLES, RIM_WORDS, Reflectance, Tail,
};

/// The cache: its nodes' light, and where to find it.
pub struct CacheMemory {
    /// Light without the suns' own; in alpha, the mean transmittance towards the suns.
    pub light: Image,
    /// Flux of the light; `None` in an isotropic medium without surfaces.
    pub flux: Option<Image>,
    /// The features that decide what the images hold.
    pub(super) features: Features,
    /// The place of each brick of the lattice in the images.
    pub pages: Image,
    /// The brick in each place.
    pub(super) bricks: BrickRecords,
    pub layout: CacheLayout,
    /// For each place, a bit a cube: whether a surface cuts it; and two bits a node: on which side of the surfaces it is.
    /// `None` where no surface stops light.
    pub cuts: Option<Buffer>,
    /// For each place, a bit a cube: whether it is at the rim; `None` where there can be none.
    pub rims: Option<Buffer>,
    pub(super) work: WorkMemory,
    /// A table for each surface; `None` where there are only Lambert surfaces, which need none.
    reflectance: Option<Buffer>,
    /// For each pixel, the light that a march leaves to paths; `None` where it can leave none.
    pub tails: Option<Buffer>,
    /// Of the march that shows the cache.
    pub(in crate::render) marched: MarchedLookups,
    /// Of the march of the picture at rest.
    pub(in crate::render) marched_at_rest: MarchedLookups,
}

impl CacheMemory {
    pub(in crate::render) fn allocate(
        memory: &Arc<Memory>,
        layout: &CacheLayout,
        scene: &GpuScene,
    ) -> Result<CacheMemory> {
        let features = scene.features();
        let format = if layout.is_f16 {
            Format::R16G16B16A16_SFLOAT
        } else {
            Format::R32G32B32A32_SFLOAT
        };
        let nodes = |name, extent| {
            let desc = ImageDesc::volumetric(name, extent, format);
            Image::new(memory, desc.written().zeroed())
        };
        let slots = slots(&memory.limits, scene);
        let if_needed = |is_needed: bool, name, bytes| {
            let buffer = || Buffer::new(memory, BufferDesc::device(name, bytes));
            is_needed.then(buffer).transpose()
        };
        let angles = features.surface_count * REFLECTANCE_ANGLES;
        let flux = flux_extent(layout, &features).map(|extent| nodes("cache: flux", extent));
        Ok(CacheMemory {
            light: nodes("cache: light", layout.extent())?,
            flux: flux.transpose()?,
            features,
            pages: Image::new(memory, pages_desc(layout))?,
            bricks: BrickRecords::allocate(memory, layout)?,
            layout: layout.clone(),
            cuts: if_needed(
                features.full_light,
                "cache: cuts",
                bytes_of_words(layout, CUT_WORDS),
            )?,
            rims: if_needed(
                features.has_rim_cubes,
                "cache: rim",
                bytes_of_words(layout, RIM_WORDS),
            )?,
            work: WorkMemory::allocate(memory, layout, &features, slots)?,
            reflectance: if_needed(
                features.has_reflectance_table(),
                "reflectance",
                bytes_of::<Reflectance>(angles),
            )?,
            tails: if_needed(
                features.has_tails,
                "tails",
                tail_bytes(scene.parts.view.size),
            )?,
            marched: MarchedLookups::allocate(memory, "marched lookups")?,
            marched_at_rest: MarchedLookups::allocate(memory, "marched lookups at rest")?,
        })
    }

    /// Takes another layout of the same format; what the images held is gone.
    pub(super) fn lay_out(&mut self, layout: &CacheLayout) -> Result<()> {
        self.light.resize(layout.extent())?;
        let flux_extent = flux_extent(layout, &self.features);
        if let (Some(flux), Some(extent)) = (&mut self.flux, flux_extent) {
            flux.resize(extent)?;
        }
        self.pages.resize(pages_desc(layout).extent)?;
        self.bricks.lay_out(layout)?;
        if let Some(cuts) = &mut self.cuts {
            cuts.resize(bytes_of_words(layout, CUT_WORDS))?;
        }
        if let Some(rims) = &mut self.rims {
            rims.resize(bytes_of_words(layout, RIM_WORDS))?;
        }
        self.layout = layout.clone();
        let (slots, limits) = (self.work.slots(), self.light.limits());
        self.work.resize(layout, &self.features, slots, limits)
    }

    /// Writes the layout, and begins the counts of the samples that marches take.
    pub fn begin(&self, frame: &mut Frame, staging: &mut Buffer) -> Result<()> {
        self.upload_layout(frame, staging)?;
        frame.run(|recording| {
            self.marched.begin(recording)?;
            self.marched_at_rest.begin(recording)
        })
    }

    /// Writes the page table and the bricks.
    pub fn upload_layout(&self, frame: &mut Frame, staging: &mut Buffer) -> Result<()> {
        self.bricks.upload(frame)?;
        let pages = self.layout.pages();
        copy::upload(frame, staging, &self.pages, bytemuck::cast_slice(&pages))
    }

    pub fn active_bricks(&self) -> u32 {
        self.layout.active.len() as u32
    }

    /// Makes room for a picture of another size, and for paths in `slots` slots.
    pub fn resize_for_picture(&mut self, size: [u32; 2], slots: u32) -> Result<()> {
        if let Some(tails) = &mut self.tails {
            tails.resize(tail_bytes(size))?;
        }
        let limits = self.light.limits();
        self.work
            .resize(&self.layout, &self.features, slots, limits)
    }

    pub fn images(&self) -> impl Iterator<Item = &Image> {
        std::iter::once(&self.light).chain(&self.flux)
    }

    /// The bricks that have memory, in order of their places.
    pub fn bricks_mut(&mut self) -> &mut [Brick] {
        self.bricks.records_mut(self.layout.active.len())
    }

    /// For a pass with a workgroup for each brick: the number of bricks and how many form a row of workgroups; and
    /// the pass's threads.
    pub fn for_each_brick(&self) -> ([u32; 2], [u32; 3]) {
        // Vulkan promises no more than 65535 rows of workgroups, and there may be millions of bricks.
        const ROW: u32 = 1024;
        let bricks = self.active_bricks();
        let rows = bricks.div_ceil(ROW);
        ([bricks, ROW], [ROW * BRICK, rows * BRICK, BRICK])
    }

    /// The resource that filling the cache and weighing its bricks need, besides those for reading the cache.
    pub fn brick_binding(&self) -> (&'static str, Binding<'_>) {
        ("bricks", self.bricks.binding())
    }

    /// The images that writing light needs.
    pub fn output_bindings(&self) -> [(&'static str, Binding<'_>); 2] {
        [
            ("light_out", Binding::Image(&self.light)),
            ("flux_out", self.flux_or_other()),
        ]
    }

    /// The resources that reading the cache needs.
    pub fn bindings(&self) -> [(&'static str, Binding<'_>); 5] {
        [
            ("cache_light", Binding::Image(&self.light)),
            ("cache_flux", self.flux_or_other()),
            ("pages", Binding::Image(&self.pages)),
            self.cuts_binding(),
            self.rims_binding(),
        ]
    }

    /// The resource for the light that a march leaves to paths.
    pub fn tails_binding(&self) -> (&'static str, Binding<'_>) {
        ("tails", self.or_other(&self.tails))
    }

    /// The resource by which surfaces reflect cached light.
    pub fn reflectance_binding(&self) -> (&'static str, Binding<'_>) {
        ("reflectances", self.or_other(&self.reflectance))
    }

    fn cuts_binding(&self) -> (&'static str, Binding<'_>) {
        ("cuts", self.or_other(&self.cuts))
    }

    fn rims_binding(&self) -> (&'static str, Binding<'_>) {
        ("rims", self.or_other(&self.rims))
    }

    /// A buffer, or another one where the scene does without it: a shader's descriptor has to hold something, although
    /// no branch that runs reads it.
    fn or_other<'a>(&'a self, buffer: &'a Option<Buffer>) -> Binding<'a> {
        Binding::Buffer(buffer.as_ref().unwrap_or(&self.work.slot_nodes))
    }

    /// The flux, or another image for the same reason.
    fn flux_or_other(&self) -> Binding<'_> {
        Binding::Image(self.flux.as_ref().unwrap_or(&self.light))
    }

    /// Bytes that the cache needs once it is filled.
    pub fn bytes(&self) -> u64 {
        let images = self.images().map(|i| i.desc().bytes());
        let bits = self.cuts.iter().chain(&self.rims).map(|b| b.desc().bytes);
        let bits = bits.sum::<u64>();
        images.sum::<u64>() + self.pages.desc().bytes() + self.bricks.bytes() + bits
    }
}

/// Texels of the flux. Those of a node lie side by side.
fn flux_extent(layout: &CacheLayout, features: &Features) -> Option<[u32; 3]> {
    let step = match (features.has_node_flux, features.has_surface_fluxes) {
        (false, false) => return None,
        (true, _) => 1,
        (false, true) => 2,
    };
    let [x, y, z] = layout.extent().map(|n| n / step);
    Some([features.flux_texels() * x, y, z])
}

/// A texel for each brick of the cache's lattice.
fn pages_desc(layout: &CacheLayout) -> ImageDesc {
    ImageDesc::volumetric("cache: pages", layout.bricks, Format::R32_UINT)
}

fn tail_bytes([width, height]: [u32; 2]) -> u64 {
    bytes_of::<Tail>(1) * u64::from(width) * u64::from(height)
}

/// Bytes for so many words for each place.
fn bytes_of_words(layout: &CacheLayout, words: u32) -> u64 {
    layout.places.map(u64::from).iter().product::<u64>() * bytes_of::<u32>(words)
}
