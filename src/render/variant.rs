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
    /// The variant as scenes name it.
    pub fn selected(&self) -> scene::Variant {
        match self {
            Variant::NonCaching => scene::Variant::NonCaching,
            Variant::Caching(_) => scene::Variant::Caching,
            Variant::Published => scene::Variant::Published,
        }
    }

    /// The word that selects the variant in scene files and on the command line.
    pub fn word(&self) -> &'static str {
        self.selected().name()
    }

    /// The variant with its cache's resolution, as in "caching at scale 0.5 in f16".
    pub fn description(&self) -> String {
        match self {
            Variant::Caching(layout) => layout.description(),
            other => other.word().to_string(),
        }
    }

    /// Whether a picture is the mean of samples, which have numbers. In `published`, an update of all cells counts as one, and
    /// has none.
    pub fn has_samples(&self) -> bool {
        !matches!(self, Variant::Published)
    }

    /// Whether a picture differs from the truth by noise alone, so that those of other variants can be compared with it.
    pub fn is_unbiased(&self) -> bool {
        matches!(self, Variant::NonCaching)
    }

    pub fn cache(&self) -> Option<&CacheLayout> {
        match self {
            Variant::Caching(layout) => Some(layout),
            Variant::NonCaching | Variant::Published => None,
        }
    }
}
