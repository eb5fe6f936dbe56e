//! The caches that a scene allows, from the best to the coarsest.
//!
//! The ladder goes down by predicted quality: a coarser cache loses more than a shorter float; rendering without a cache is
//! unbiased, but takes longer to reach the same noise.

use super::Planner;
use crate::error::MemoryError;
use crate::render::layout::CacheLayout;
use crate::scene::{CacheFormat, CacheScale, Variant};

/// Nodes that a CPU should fill at most, unless the picture has more pixels: a node's path costs as much as a
/// pixel's. A GPU is some hundred times as fast. The limit holds for `auto` alone: a scale that is set by name is
/// granted.
const FEW_NODES: u64 = 1 << 18;
pub(super) const COARSEST: f64 = 0.125;

/// A cache that the scene allows.
pub struct Rung {
    pub scale: f64,
    pub format: CacheFormat,
    /// Fails where the device's images are too small.
    pub layout: Result<CacheLayout, MemoryError>,
}

impl Planner<'_> {
    /// The caches that the scene allows, best first.
    pub(super) fn rungs(&self) -> impl Iterator<Item = Rung> + use<> {
        let render = &self.scene.render;
        let scales = match render.cache_scale {
            CacheScale::Auto => vec![1.0, 0.5, 0.25, COARSEST],
            CacheScale::Fixed(scale) => vec![scale],
        };
        let formats = match render.cache_format {
            CacheFormat::Auto => vec![CacheFormat::F32, CacheFormat::F16],
            format => vec![format],
        };
        let occupancy = self.uncached.occupancy(self.volume);
        let (dims, most) = (self.volume.dims, self.limits.max_image_3d);
        scales.into_iter().flat_map(move |scale| {
            // To look for the bricks takes time, and formats have the same.
            let layout = CacheLayout::new(dims, &occupancy, scale, formats[0], most);
            formats.clone().into_iter().map(move |format| Rung {
                scale,
                format,
                layout: layout.clone().map(|layout| layout.with_format(format)),
            })
        })
    }

    /// Whether the last of these is the coarsest cache in the shortest floats.
    pub(super) fn allows_the_smallest(&self) -> bool {
        let render = &self.scene.render;
        let is_coarsest = match render.cache_scale {
            CacheScale::Auto => true,
            CacheScale::Fixed(scale) => scale <= COARSEST,
        };
        is_coarsest && render.cache_format != CacheFormat::F32
    }

    /// The number of the cache's nodes, if the device should not fill so many.
    pub(super) fn too_many_nodes(&self, layout: &CacheLayout) -> Option<u64> {
        let render = &self.scene.render;
        let pixels = render.size.iter().map(|&n| n as u64).product::<u64>();
        let limits_nodes = self.limits.kind.is_software()
            && render.cache_scale == CacheScale::Auto
            && layout.scale > COARSEST;
        Some(layout.active_nodes()).filter(|&nodes| limits_nodes && nodes > FEW_NODES.max(pixels))
    }

    /// Why no cache is looked for, and what the next better variant is then said to be; `None` where one is looked for.
    pub(super) fn why_no_cache(&self) -> Option<[&'static str; 2]> {
        match self.scene.render.variant {
            Variant::Caching => None,
            Variant::Auto => self.useless().map(|why| [why, "none is of use here"]),
            Variant::NonCaching | Variant::Published => {
                Some(["it was asked for", "not looked for"])
            }
        }
    }

    /// The reason why a cache is of no use to the scene, if there is one.
    fn useless(&self) -> Option<&'static str> {
        let parts = &self.uncached.parts;
        if self.scene.render.max_bounces > 0 {
            Some("render.max_bounces is set, and a cache holds light after any number of bounces")
        } else if !parts.medium.scatters() {
            Some("no medium scatters light that a cache could hold")
        } else if parts.lights.brightest() <= 0.0 {
            Some("no light shines that a cache could hold")
        } else {
            None
        }
    }
}
