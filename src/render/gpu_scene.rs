//! A scene as the GPU has it: its parts, the variant that renders it, and the features and constants of the shaders
//! that follow from both.

use super::features::Features;
use super::layout::{BrickLayout, CacheLayout, Occupancy};
use super::parts::{Changes, Derived, Field, Part, Parts, Surfaces};
use super::shared::{DENSE_DEPTH, SceneConstants};
use super::variant::Variant;
use crate::error::Result;
use crate::gpu::Format;
use crate::scene::volume::{StoredType, Volume};
use crate::scene::{self, Background, Scene};

#[derive(Debug, Clone, PartialEq)]
pub struct GpuScene {
    pub parts: Parts,
    pub variant: Variant,
    /// How the volume is cut into bricks, if the device holds only some of them at a time.
    pub bricks: Option<BrickLayout>,
}

impl GpuScene {
    /// The scene without a cache: `published` if it asks for that, `non-caching` otherwise.
    pub fn new(scene: &Scene, volume: &Volume, seed: u32) -> GpuScene {
        GpuScene {
            parts: Parts::new(scene, volume, seed),
            variant: match scene.render.variant {
                scene::Variant::Published => Variant::Published,
                _ => Variant::NonCaching,
            },
            bricks: None,
        }
    }

    /// This scene for another variant.
    pub fn with_variant(self, variant: Variant) -> GpuScene {
        GpuScene { variant, ..self }
    }

    /// This scene with its volume whole (`None`), or in bricks.
    pub fn with_bricks(self, bricks: Option<BrickLayout>) -> GpuScene {
        GpuScene { bricks, ..self }
    }

    /// This scene for the variant with a cache.
    pub fn with_cache(self, layout: CacheLayout) -> GpuScene {
        self.with_variant(Variant::Caching(layout))
    }

    /// An edited scene with the same volume, on the same device and with the same variant.
    pub fn changed_to(&self, scene: &Scene, volume: &Volume) -> GpuScene {
        GpuScene {
            parts: self.parts.changed_to(scene, volume),
            variant: self.variant.clone(),
            bricks: self.bricks,
        }
    }

    /// This scene with its cache layout, if it has one, fitted to the scene's parts.
    pub fn refitted(self, volume: &Volume, most_texels: u32) -> Result<GpuScene> {
        let Variant::Caching(layout) = &self.variant else {
            return Ok(self);
        };
        let layout =
            layout.refitted(self.parts.field.dims, &self.occupancy(volume), most_texels)?;
        Ok(self.with_cache(layout))
    }

    /// This scene with a picture of another size.
    pub fn reduced_to(&self, size: [u32; 2]) -> GpuScene {
        let mut other = self.clone();
        other.parts.view = other.parts.view.with_size(size);
        other
    }

    /// The macrocells in which the cache needs memory.
    pub fn occupancy(&self, volume: &Volume) -> Occupancy {
        Occupancy::new(&self.parts, volume)
    }

    /// The parts of the scene that differ from those of `before`. The variant and the layout of bricks are not compared.
    pub fn changes_from(&self, before: &GpuScene) -> Changes {
        Changes::between(&before.parts, &self.parts)
    }

    /// Whether light that is cached for `self` is right for `other` as well.
    pub fn shares_light_with(&self, other: &GpuScene) -> bool {
        self.variant == other.variant && !other.changes_from(self).invalidates(Derived::CachedLight)
    }

    /// Whether the passes and images made for `self` also serve `other`, which has the same volume. They do not if
    /// the sky's image is another, since its size may differ, or if `other` needs other features.
    pub fn passes_serve(&self, other: &GpuScene) -> bool {
        let has_same_sky = !other.changes_from(self).has(Part::Lights)
            || self.parts.lights.sky_image == other.parts.lights.sky_image;
        has_same_sky && self.features() == other.features()
    }

    /// Whether the scene has light that a cache could hold.
    pub fn has_scattered_light(&self) -> bool {
        self.parts.medium.scatters() && self.parts.lights.brightest() > 0.0
    }

    /// The features that shaders are compiled with.
    pub fn features(&self) -> Features {
        let Parts {
            field,
            medium,
            lights,
            surfaces,
            clips,
            view,
            background,
            max_bounces: _,
            request: _,
            display: _,
            seed: _,
        } = &self.parts;
        let mut features = Features {
            clip_count: clips.len() as u32,
            background_is_color: matches!(background, Background::Color(_)),
            background_is_transparent: *background == Background::Transparent,
            first_cached_collision: self.first_cached_collision(),
            cache_is_f16: self.variant.cache().is_some_and(|layout| layout.is_f16),
            is_in_bricks: self.bricks.is_some(),
            volume_images: self.volume_images() as u32,
            ..Features::default()
        };
        field.require(&mut features);
        medium.require(&mut features);
        lights.require(&mut features);
        if let Variant::Caching(layout) = &self.variant {
            features.has_rim_cubes = layout.may_have_rims(&self.parts);
            features.is_dense = medium.largest_extinction() * field.largest_spacing() > DENSE_DEPTH;
        }
        surfaces.require(&mut features);
        view.require(&mut features);
        features.has_tails =
            features.is_marched() && (features.surface_count > 0 || features.has_rim_cubes);
        let has_cache = features.first_cached_collision > 0;
        features.has_tents = has_cache && medium.has_tents();
        features.suns_differ = has_cache
            && lights.suns.len() > 1
            && (features.is_anisotropic || !lights.suns_have_one_color());
        features.has_node_flux = has_cache && features.is_anisotropic;
        features.has_surface_fluxes =
            has_cache && !features.is_anisotropic && features.surface_count > 0;
        let is_grey = lights.have_one_color()
            && medium.is_grey()
            && surfaces.obstacles().is_none_or(Surfaces::are_grey);
        features.flux_columns = match (features.has_node_flux, features.has_surface_fluxes) {
            (false, false) => 0,
            (true, _) if is_grey => 1,
            _ => 3,
        };
        features
    }

    /// The collision from which a path reads the cache: 1 is the first, 0 means never.
    fn first_cached_collision(&self) -> u32 {
        match &self.variant {
            Variant::Caching(_) => {
                let Parts { medium, lights, .. } = &self.parts;
                first_cached_collision(medium.g, lights.unevenness())
            }
            Variant::NonCaching | Variant::Published => 0,
        }
    }

    /// The constants of the scene that shaders read.
    pub fn constants(&self) -> SceneConstants {
        let Parts {
            field,
            medium,
            lights,
            surfaces: _,
            clips: _,
            view,
            background,
            max_bounces,
            request: _,
            display: _,
            seed,
        } = &self.parts;
        let cache = self.variant.cache();
        SceneConstants {
            dims: field.dims,
            macrocells: field.macrocells(),
            blocks: self.blocks(),
            block_size: medium.block_size as f32,
            spacing: field.spacing,
            half_extent: field.half_extent,
            stored_max: field.stored.max(),
            density: medium.density,
            g: medium.g,
            transfer_segments: medium.segments(),
            transfer_bins: medium.bins(),
            color: medium.first_color(),
            linear_opacity: medium.linear_opacity.unwrap_or_default(),
            max_bounces: *max_bounces,
            seed: *seed,
            size: view.size,
            through_centres: view.through_centres as u32,
            start: view.start,
            start_distance: view.start_distance,
            forward: view.forward,
            right: view.right,
            up: view.up,
            environment: lights.environment,
            sky: lights.sky_in_cache_units(),
            image_probability: lights.image_probability(),
            image_cells: lights.image_cells(),
            background: match background {
                Background::Color(color) => color.map(|c| c as f32),
                Background::Environment | Background::Transparent => [0.0; 3],
            },
            suns_grey: lights.suns_grey(),
            cache_nodes: cache.map_or([0; 3], |layout| layout.nodes),
            cache_step: cache.map_or([0.0; 3], |layout| layout.step),
            cache_places: cache.map_or([0; 3], |layout| layout.places),
            cache_stride: cache.map_or(0, |layout| (1.0 / layout.scale).max(1.0) as u32),
            volume_bricks: self.bricks.map_or([0; 3], |layout| layout.bricks),
            brick_shift: self.bricks.map_or(0, |layout| layout.side.ilog2()),
            cache_unit: lights.cache_unit(),
        }
    }

    /// Images that hold the volume.
    pub fn volume_images(&self) -> usize {
        self.bricks.map_or(1, |layout| layout.images as usize)
    }

    /// Texels of an image that holds the volume, or bricks of it.
    pub fn volume_extent(&self) -> [u32; 3] {
        match &self.bricks {
            Some(layout) => layout.extent(),
            None => self.parts.field.dims,
        }
    }

    /// Blocks along each axis; each has a majorant.
    pub fn blocks(&self) -> [u32; 3] {
        let Parts { field, medium, .. } = &self.parts;
        field.boxes_of(medium.block_size)
    }

    /// A texel of the cache for light that has not been traced yet: all light, dimmed by the same factor everywhere.
    /// Its alpha is negative, which marks it as a guess (glsl/include/cache.glsl).
    pub fn guessed_light(&self) -> [f32; 4] {
        const ARRIVES: f32 = 0.6;
        let lights = &self.parts.lights;
        let (sky, unit) = (lights.sky_radiance(), lights.cache_unit());
        let suns = lights.suns_grey() / (4.0 * std::f32::consts::PI);
        let light = |c: usize| ARRIVES * (sky[c] / unit[c] + suns * ARRIVES);
        [light(0), light(1), light(2), -ARRIVES]
    }
}

impl Field {
    /// The volume's format on the GPU, in the data's own width.
    pub fn format(&self) -> Format {
        match self.stored {
            StoredType::U8 => Format::R8_UNORM,
            StoredType::U16 => Format::R16_UNORM,
            StoredType::F32 => Format::R32_SFLOAT,
        }
    }
}

/// A path reads the cache from the collision m on for which |g|^m, the mean cosine between its first direction and that
/// after m collisions, is at most this. Two moments of the light cannot represent what a narrower phase function selects
/// from it. With ¼ instead, a slab of g = .85 reflects 1.2 % too much.
const LARGEST_MEAN_COSINE: f32 = 0.15;

/// Largest error, as a fraction of the light, that reading the cache at the first collision may make because the cache holds
/// only two moments of the environment's light; the second-order part of the Henyey–Greenstein phase function has weight
/// 5g². With one bright spot in a dark environment and g = −0.15 the error was a tenth (`transport caching::anisotropy`).
const MOST_BEYOND_FLUX: f32 = 0.005;

/// The smallest m ≥ 1 with |g|^m ≤ `LARGEST_MEAN_COSINE`, but 2 where the sky is too uneven for the first collision.
fn first_cached_collision(g: f32, unevenness: f32) -> u32 {
    match g.abs() {
        g if g <= LARGEST_MEAN_COSINE => 1 + u32::from(5.0 * g * g * unevenness > MOST_BEYOND_FLUX),
        g => (LARGEST_MEAN_COSINE.ln() / g.ln()).ceil() as u32,
    }
}
