//! What was picked where a scene says "auto": a render that continues another keeps to it.

use serde::{Deserialize, Serialize};

use crate::render::Variant;
use crate::scene::{self, CacheFormat, CacheScale, Scene};

/// The settings that were picked where the scene says "auto", and why.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Settings {
    variant: scene::Variant,
    cache_scale: CacheScale,
    cache_format: CacheFormat,
    /// As in [`Choice`](crate::render::Choice).
    pub reason: String,
}

impl Settings {
    pub fn of(variant: &Variant, reason: &str) -> Settings {
        let layout = variant.cache();
        Settings {
            variant: variant.selected(),
            cache_scale: layout.map_or(CacheScale::Auto, |l| CacheScale::Fixed(l.scale)),
            cache_format: layout.map_or(CacheFormat::Auto, |layout| layout.format()),
            reason: reason.into(),
        }
    }

    /// The scene with these settings wherever it leaves one open.
    pub fn apply_to(&self, scene: &Scene) -> Scene {
        let mut applied = scene.clone();
        let render = &mut applied.render;
        if render.variant == scene::Variant::Auto {
            render.variant = self.variant;
        }
        if render.cache_scale == CacheScale::Auto {
            render.cache_scale = self.cache_scale;
        }
        if render.cache_format == CacheFormat::Auto {
            render.cache_format = self.cache_format;
        }
        applied
    }
}
