//! The three ways to render, between which a plan decides. `estimator.rs` gives each its passes and its memory.

use super::layout::CacheLayout;
use crate::scene;

/// The variant that renders.
#[derive(Debug, Clone, PartialEq)]
pub enum Variant {
    /// Paths from the camera.
    NonCaching,
    /// Paths from the nodes of a cache; pictures read the cache.
    Caching(CacheLayout),
    /// The method of the paper that Isolume started from, as a baseline.
    Published,
}

impl Variant {
    /// The word that selects the variant in scene files and on the command line.
    pub fn word(&self) -> &'static str {
        let selected = match self {
            Variant::NonCaching => scene::Variant::NonCaching,
            Variant::Caching(_) => scene::Variant::Caching,
            Variant::Published => scene::Variant::Published,
        };
        selected.name()
    }

    /// The variant with its cache's resolution, as in "caching at scale 0.5 in f16".
    pub fn description(&self) -> String {
        match self {
            Variant::Caching(layout) => layout.description(),
            other => other.word().to_string(),
        }
    }

    pub fn cache(&self) -> Option<&CacheLayout> {
        match self {
            Variant::Caching(layout) => Some(layout),
            Variant::NonCaching | Variant::Published => None,
        }
    }
}
