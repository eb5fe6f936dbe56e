//! A resolved, complete and valid scene. Nothing here knows Vulkan.
//!
//! The scene *file* ([`file`]) is what the user wrote; a [`Scene`] is its meaning once the volume is known and every
//! default is filled in. Colours are linear Rec. 709, lengths are world units, values are the data's own (after slope
//! and intercept).

pub mod camera;
pub mod file;
pub mod light;
pub mod medium;
mod open;
pub mod preset;
pub mod surface;
pub mod volume;
mod words;

use serde::{Deserialize, Serialize};

pub use camera::{Camera, Projection, Side};
pub use file::{Edit, SceneFile, describe, resolve};
pub use light::*;
pub use medium::{Medium, TransferPoint};
pub use open::{Opened, bare_volume, is_scene, open};
pub use surface::{Disney, Isosurface, LightModel, Normals, Shading, Surfaces};
use words::words;

/// A half-space that is cut away: points with dot(normal, p) > offset are vacuum.
#[derive(Debug, Clone, PartialEq)]
pub struct ClipPlane {
    /// Unit length; the offset is scaled with it.
    pub normal: [f64; 3],
    /// In world units.
    pub offset: f64,
}

/// Everything that decides the picture, apart from the volume's voxels.
#[derive(Debug, Clone, PartialEq)]
pub struct Scene {
    /// `None`: vacuum.
    pub medium: Option<Medium>,
    pub surfaces: Surfaces,
    pub lights: Lights,
    pub clips: Vec<ClipPlane>,
    pub camera: Camera,
    pub render: RenderSettings,
}

/// The `[render]` table.
#[derive(Debug, Clone, PartialEq)]
pub struct RenderSettings {
    /// Width and height in pixels.
    pub size: [u32; 2],
    /// Collisions and reflections on a path; 0 = no limit.
    pub max_bounces: u32,
    pub variant: Variant,
    pub cache_scale: CacheScale,
    pub cache_format: CacheFormat,
    pub background: Background,
    /// In stops; for PNG only.
    pub exposure: f64,
    pub tone: Tone,
}

impl RenderSettings {
    /// What is wrong with `max_bounces` in a variant that was asked for by name, as the end of a sentence about that key.
    pub fn conflict(&self) -> Option<String> {
        (self.max_bounces != 0 && self.variant == Variant::Caching).then(|| {
            format!(
                "found {}, expected 0 with variant \"caching\", since a cache holds light after any number of bounces; use \
                 variant = \"non-caching\"",
                self.max_bounces
            )
        })
    }
}

words! {
    pub enum Variant {
        Auto = "auto",
        Caching = "caching",
        NonCaching = "non-caching",
        Published = "published",
    }
}

/// Nodes of the cache per voxel along an axis.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(try_from = "toml::Value", into = "toml::Value")]
pub enum CacheScale {
    Auto,
    Fixed(f64),
}

words! {
    pub enum CacheFormat {
        Auto = "auto",
        F16 = "f16",
        F32 = "f32",
    }
}

/// The background that a ray sees if it meets nothing.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(try_from = "toml::Value", into = "toml::Value")]
pub enum Background {
    Environment,
    /// Black, with coverage in the alpha channel.
    Transparent,
    Color([f64; 3]),
}

words! {
    pub enum Tone {
        /// Clipping, then sRGB.
        Linear = "linear",
        Filmic = "filmic",
    }
}
