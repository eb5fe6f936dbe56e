//! A scene as the shaders read it: all that it puts on the GPU besides the volume.

use std::sync::Arc;

use bytemuck::Zeroable;

use super::cache_layout::CacheLayout;
use super::convert::{
    clips, features, linear_opacity, place_camera, suns, surfaces, transfer, transfer_segments,
};
use super::environment_table;
use super::filter_probe::filter_is_precise;
use super::majorants;
use super::occupancy::Occupancy;
use super::shared::{
    self, Clip, EnvironmentCell, Features, MACROCELL, SceneConstants, Sun, Surface,
};
use crate::error::Result;
use crate::gpu::{Device, Format, Shaders};
use crate::scene::volume::{StoredType, Volume};
use crate::scene::{Background, Camera, EnvironmentImage, Scene, Variant};

/// What the scene puts on the GPU, besides the volume.
#[derive(Clone)]
pub struct SceneBuffers {
    pub constants: SceneConstants,
    pub features: Features,
    pub transfer: Vec<TransferPoint>,
    pub surfaces: Vec<Surface>,
    pub suns: Vec<Sun>,
    pub clips: Vec<Clip>,
    pub sky: Vec<EnvironmentCell>,
    /// A single black texel if the scene has no image.
    pub environment: EnvironmentImage,
    /// Where the cache's nodes are, in the variant that has one.
    pub cache: Option<CacheLayout>,
    /// Whether the variant is the published baseline.
    pub published: bool,
}

/// A point of the transfer function.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct TransferPoint {
    /// Stored value.
    pub value: f32,
    pub opacity: f32,
    pub color: [f32; 3],
}

impl SceneBuffers {
    /// Probes the device's filter, if shaders can use it: that decides how they read the volume.
    pub fn new(
        device: &Arc<Device>,
        scene: &Scene,
        volume: &Volume,
        seed: u32,
    ) -> Result<SceneBuffers> {
        let shaders = Shaders::new(shared::glsl())?;
        let precise =
            !device.loads_texels && filter_is_precise(device, &shaders, volume_format(volume))?;
        Ok(SceneBuffers::with_filter(scene, volume, seed, !precise))
    }

    /// Without a probe, for a plan: nothing of it decides a size.
    pub fn unprobed(scene: &Scene, volume: &Volume) -> SceneBuffers {
        SceneBuffers::with_filter(scene, volume, 0, false)
    }

    fn with_filter(scene: &Scene, volume: &Volume, seed: u32, filter_in_shader: bool) -> Self {
        let suns = suns(scene);
        let image = scene.environment.image.as_ref();
        let table = image.map(environment_table::build).unwrap_or_default();
        let image_probability = match (image, suns.is_empty()) {
            (None, _) => 0.0,
            (Some(_), true) => 1.0,
            (Some(_), false) => 0.5,
        };
        let image = image.cloned().unwrap_or(EnvironmentImage {
            width: 1,
            height: 1,
            texels: vec![[0.0; 3]],
        });
        let transfer = transfer(scene, volume);
        let line = linear_opacity(&transfer, volume);
        let environment = scene.environment.radiance.map(|c| c as f32);
        let all = brightness(&suns, environment, &image);
        let cache_unit = all.map(|light| if light > 0.0 { light } else { 1.0 });
        let density = scene.medium.as_ref().map_or(0.0, |m| m.density as f32);
        let majorant_size =
            majorants::cell_size(volume, density * majorants::largest_opacity(&transfer));
        let mut constants = SceneConstants {
            transfer_segments: transfer_segments(&transfer),
            color: transfer.first().map_or([0.0; 3], |p| p.color),
            linear_opacity: line.unwrap_or_default(),
            dims: volume.dims,
            macrocells: cells(volume.dims, MACROCELL),
            majorant_cells: cells(volume.dims, majorant_size),
            majorant_size: majorant_size as f32,
            spacing: volume.spacing.map(|s| s as f32),
            half_extent: volume.extent().map(|e| (0.5 * e) as f32),
            stored_max: volume.stored.max(),
            density,
            g: scene.medium.as_ref().map_or(0.0, |m| m.g as f32),
            max_bounces: scene.render.max_bounces,
            seed,
            size: scene.render.size,
            environment,
            image_probability,
            image_cells: table.cells,
            background: match scene.render.background {
                Background::Color(color) => color.map(|c| c as f32),
                _ => [0.0; 3],
            },
            suns_grey: suns
                .iter()
                .map(|s| grey(over(s.irradiance, cache_unit)))
                .sum(),
            cache_unit,
            ..SceneConstants::zeroed()
        };
        place_camera(&mut constants, &scene.camera);
        SceneBuffers {
            constants,
            features: features(
                scene,
                &transfer,
                line.is_some(),
                &suns,
                volume,
                filter_in_shader,
            ),
            transfer,
            surfaces: surfaces(scene, volume),
            clips: clips(scene),
            suns,
            sky: table.sky,
            environment: image,
            cache: None,
            published: scene.render.variant == Variant::Published,
        }
    }

    /// The same scene for the variant with a cache.
    pub fn with_cache(mut self, layout: CacheLayout) -> SceneBuffers {
        let constants = &mut self.constants;
        constants.cache_nodes = layout.nodes;
        constants.cache_step = layout.step;
        constants.cache_bricks = layout.bricks;
        constants.cache_places = layout.places;
        constants.cache_stride = (1.0 / layout.scale).max(1.0) as u32;
        self.features.cache_order = cache_order(constants.g).max(least_order(&self.features));
        self.features.cache_is_f16 = layout.is_f16;
        self.cache = Some(layout);
        self
    }

    /// Another scene of the same volume, on the same device and with the same cache.
    pub fn changed_to(&self, scene: &Scene, volume: &Volume) -> SceneBuffers {
        let seed = self.constants.seed;
        let changed =
            SceneBuffers::with_filter(scene, volume, seed, self.features.filter_in_shader);
        match &self.cache {
            Some(layout) => changed.with_cache(layout.clone()),
            None => changed,
        }
    }

    /// With its cache, if there is one, made to fit after a change.
    pub fn refitted(self, volume: &Volume, most_texels: u32) -> Result<SceneBuffers> {
        let Some(layout) = &self.cache else {
            return Ok(self);
        };
        let occupancy = self.occupancy(volume);
        let layout = layout.refitted(self.constants.dims, &occupancy, most_texels)?;
        Ok(self.with_cache(layout))
    }

    /// A texel of the cache for light that nobody has traced yet.
    pub fn guessed_light(&self) -> [f32; 4] {
        const ARRIVES: f32 = 0.6;
        let constants = &self.constants;
        let sky = brightness(&[], constants.environment, &self.environment);
        let sky = over(sky, constants.cache_unit);
        let suns = constants.suns_grey / (4.0 * std::f32::consts::PI);
        let light = sky.map(|sky| ARRIVES * (sky + suns * ARRIVES));
        [light[0], light[1], light[2], ARRIVES]
    }

    /// The same picture with fewer pixels.
    pub fn reduced_to(&self, size: [u32; 2]) -> SceneBuffers {
        let mut other = self.clone();
        other.constants.size = size;
        other
    }

    /// The same scene from elsewhere.
    pub fn seen_by(&self, camera: &Camera) -> SceneBuffers {
        let mut other = self.clone();
        place_camera(&mut other.constants, camera);
        other
    }

    /// The texels of the transfer function's image, a column a point, of which the last stands twice:
    /// value, 1 / (distance to the next value), opacity and the next point's opacity; below, colour.
    pub fn transfer_texels(&self) -> Vec<[f32; 4]> {
        let points = || self.transfer.iter().chain(self.transfer.last());
        let next = points().skip(1).chain(self.transfer.last());
        let shares = points().zip(next).map(|(point, next)| {
            let distance = next.value - point.value;
            let per_value = if distance > 0.0 { 1.0 / distance } else { 0.0 };
            [point.value, per_value, point.opacity, next.opacity]
        });
        let colors = points().map(|p| p.color);
        shares
            .chain(colors.map(|[r, g, b]| [r, g, b, 0.0]))
            .collect()
    }

    /// Where the cache needs memory.
    pub fn occupancy(&self, volume: &Volume) -> Occupancy {
        Occupancy::new(
            volume.macrocell_ranges(),
            &self.constants,
            &self.transfer,
            self.obstacles(),
            &self.clips,
        )
    }

    /// Surfaces that stop light on its way to the cache.
    fn obstacles(&self) -> &[Surface] {
        match self.features.full_light {
            true => &self.surfaces,
            false => &[],
        }
    }

    /// Whether light cached for `self` is right for `other` as well, with the same volume. It is not
    /// where anything differs that its paths meet: medium, lights, clip planes, and in `full` light
    /// surfaces. Camera, picture and, in `local` light, surfaces do not matter, nor does how bright the
    /// lights are, and how red, as long as it is the same factor for all: the cache knows but their shares.
    pub fn shares_light_with(&self, other: &SceneBuffers) -> bool {
        let medium = |s: &SceneBuffers| (s.constants.density, s.constants.g);
        let size = |s: &SceneBuffers| (s.environment.width, s.environment.height);
        let directions = |s: &SceneBuffers| -> Vec<[f32; 3]> {
            s.suns.iter().map(|sun| sun.direction).collect()
        };
        let normals =
            |s: &SceneBuffers| s.features.full_light.then_some(s.features.analytic_normals);
        self.cache == other.cache
            && medium(self) == medium(other)
            && self.transfer == other.transfer
            && directions(self) == directions(other)
            && size(self) == size(other)
            && self.lights_are_alike(other)
            && self.clips == other.clips
            && self.obstacles() == other.obstacles()
            && normals(self) == normals(other)
    }

    /// Whether each light is the same share of all, but for rounding.
    fn lights_are_alike(&self, other: &SceneBuffers) -> bool {
        let factor = over(other.constants.cache_unit, self.constants.cache_unit);
        let is_scaled = |(a, b): ([f32; 3], [f32; 3])| {
            (0..3).all(|c| (factor[c] * a[c] - b[c]).abs() <= 1e-6 * b[c].abs())
        };
        self.lights().zip(other.lights()).all(is_scaled)
    }

    /// Each sun's irradiance, the constant sky's radiance, and its image's, texel by texel.
    fn lights(&self) -> impl Iterator<Item = [f32; 3]> {
        let suns = self.suns.iter().map(|sun| sun.irradiance);
        let sky = std::iter::once(self.constants.environment);
        suns.chain(sky)
            .chain(self.environment.texels.iter().copied())
    }
}

/// Irradiance of all suns and radiance of the sky, its image by its mean.
fn brightness(suns: &[Sun], environment: [f32; 3], image: &EnvironmentImage) -> [f32; 3] {
    std::array::from_fn(|c| {
        let suns: f32 = suns.iter().map(|sun| sun.irradiance[c]).sum();
        let texels = image.texels.iter().map(|texel| f64::from(texel[c]));
        let mean = texels.sum::<f64>() / image.texels.len() as f64;
        suns + environment[c] + mean as f32
    })
}

fn over(light: [f32; 3], unit: [f32; 3]) -> [f32; 3] {
    std::array::from_fn(|c| light[c] / unit[c])
}

/// Where the medium alone is seen, light is read all along a ray. Beside a surface a sample is a path in any
/// case, and one more collision before it reads costs little and leaves less of what thin dense layers,
/// between nodes, make a cache lose: of an engine's 0.8 % and a plant's 1.4 %, 0.5 and 0.7 % are left.
fn least_order(features: &Features) -> u32 {
    match features.surface_count {
        0 => 1,
        _ => 2,
    }
}

/// Of a direction's memory, |g| to the power of collisions, so much may be left where light is read
/// from the cache. A lattice with two moments of the light cannot hold what a narrow phase function
/// sees of it. With ¼ instead, a slab of g = .85 reflects 1.2 % too much.
const MOST_MEMORY: f32 = 0.15;

/// The smallest m ≥ 1 with |g|^m ≤ `MOST_MEMORY`.
fn cache_order(g: f32) -> u32 {
    match g.abs() {
        g if g <= MOST_MEMORY => 1,
        g => (MOST_MEMORY.ln() / g.ln()).ceil() as u32,
    }
}

fn grey(rgb: [f32; 3]) -> f32 {
    rgb.iter().sum::<f32>() / 3.0
}

/// The data's own width.
pub fn volume_format(volume: &Volume) -> Format {
    match volume.stored {
        StoredType::U8 => Format::R8_UNORM,
        StoredType::U16 => Format::R16_UNORM,
        StoredType::F32 => Format::R32_SFLOAT,
    }
}

/// Cells of `size` grid units along each axis that cover all trilinear cells.
pub(super) fn cells(dims: [u32; 3], size: u32) -> [u32; 3] {
    dims.map(|n| (n + 1).div_ceil(size))
}
