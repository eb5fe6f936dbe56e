//! A scene in the shaders' terms: stored values, single precision, grid space.
//!
//! It is split into the parts that a user changes independently, each with derived equality. Everything that
//! shaders read of a scene is made from these parts, the variant and the layout of bricks (`gpu_scene.rs`), so a key of the
//! scene file cannot reach a shader without being in a part, and `changes.rs` sees it change.

mod changes;
mod environment_table;
mod lights;
mod medium;
mod sky_image;
mod surfaces;
mod transfer_table;
mod view;

use glam::DVec3;

use crate::scene::volume::{StoredType, Volume};
use crate::scene::{self, CacheFormat, CacheScale, ClipPlane, Scene, Tone, Variant};

use super::features::Features;
use super::shared::{Clip, MACROCELL};
pub use changes::{Changes, Derived, Part};
pub use lights::Lights;
pub use medium::{Medium, TransferPoint};
pub use surfaces::Surfaces;
pub use transfer_table::transfer_extent;
pub use view::View;

/// All parts of a scene.
#[derive(Debug, Clone, PartialEq)]
pub struct Parts {
    pub field: Field,
    pub medium: Medium,
    pub lights: Lights,
    pub surfaces: Surfaces,
    pub clips: Vec<Clip>,
    pub view: View,
    pub background: scene::Background,
    /// Collisions and reflections on a path; 0 means no limit.
    pub max_bounces: u32,
    pub request: Request,
    pub display: Display,
    /// Seed of the random numbers.
    pub seed: u32,
}

/// What the volume's voxels mean, apart from the voxels themselves.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Field {
    /// Voxels along each axis.
    pub dims: [u32; 3],
    /// World units per voxel.
    pub spacing: [f32; 3],
    /// Half the box's sides, in world units.
    pub half_extent: [f32; 3],
    /// The type of a voxel on the GPU.
    pub stored: StoredType,
}

/// The variant and the cache that the user asks for.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Request {
    pub variant: Variant,
    pub cache_scale: CacheScale,
    pub cache_format: CacheFormat,
}

/// How radiance is mapped to a display.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Display {
    /// In stops.
    pub exposure: f64,
    pub tone: Tone,
}

impl Parts {
    pub fn new(scene: &Scene, volume: &Volume, seed: u32) -> Parts {
        let field = Field::new(volume);
        let lights = Lights::new(&scene.lights, None);
        Parts::with(scene, volume, field, lights, seed)
    }

    /// The parts of an edited scene with the same volume, device and seed. A sky image that is still the same
    /// is shared, and so is its sampling table.
    pub fn changed_to(&self, scene: &Scene, volume: &Volume) -> Parts {
        let lights = Lights::new(&scene.lights, self.lights.sky_image.as_ref());
        Parts::with(scene, volume, self.field, lights, self.seed)
    }

    fn with(scene: &Scene, volume: &Volume, field: Field, lights: Lights, seed: u32) -> Parts {
        let Scene {
            medium,
            surfaces,
            lights: _,
            clips,
            camera,
            render,
        } = scene;
        let radius = 0.5 * DVec3::from(volume.extent()).length();
        Parts {
            field,
            medium: Medium::new(medium.as_ref(), volume),
            lights,
            surfaces: Surfaces::new(surfaces, volume),
            clips: clips.iter().map(clip).collect(),
            view: View::new(camera, render.size, radius),
            background: render.background,
            max_bounces: render.max_bounces,
            request: Request {
                variant: render.variant,
                cache_scale: render.cache_scale,
                cache_format: render.cache_format,
            },
            display: Display {
                exposure: render.exposure,
                tone: render.tone,
            },
            seed,
        }
    }
}

impl Field {
    fn new(volume: &Volume) -> Field {
        Field {
            dims: volume.dims,
            spacing: volume.spacing.map(|s| s as f32),
            half_extent: volume.extent().map(|e| (0.5 * e) as f32),
            stored: volume.stored,
        }
    }

    /// The longest side of a voxel, in world units.
    pub fn largest_spacing(&self) -> f32 {
        self.spacing.into_iter().fold(0.0, f32::max)
    }

    /// Sets the features that shaders are compiled with because of the field.
    pub fn require(&self, features: &mut Features) {
        features.volume_bits = 8 * self.stored.bytes() as u32;
    }

    /// Macrocells along each axis.
    pub fn macrocells(&self) -> [u32; 3] {
        self.boxes_of(MACROCELL)
    }

    /// Boxes of `size` trilinear cells a side, along each axis, that cover all trilinear cells.
    pub fn boxes_of(&self, size: u32) -> [u32; 3] {
        self.dims.map(|n| (n + 1).div_ceil(size))
    }
}

fn clip(plane: &ClipPlane) -> Clip {
    Clip {
        normal: plane.normal.map(|n| n as f32),
        offset: plane.offset as f32,
    }
}

/// Whether all channels are the same, apart from rounding.
fn is_grey([r, g, b]: [f32; 3]) -> bool {
    let is_close = |x: f32| (x - r).abs() <= 1e-6 * r.abs();
    is_close(g) && is_close(b)
}

fn over(light: [f32; 3], unit: [f32; 3]) -> [f32; 3] {
    std::array::from_fn(|c| light[c] / unit[c])
}

/// A value in the data's units as a stored value.
fn stored(volume: &Volume, value: f64) -> f64 {
    (value - volume.offset) / volume.scale
}
