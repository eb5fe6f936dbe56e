//! What a render will take of the GPU's memory, before anything is allocated, and which variant that
//! allows. A plan is a dry run of the statements that allocate.
//!
//! The ladder goes down by predicted quality: a coarser cache loses more than a shorter float, and no
//! cache at all is right as well, but slow for its noise.

use std::sync::Arc;

use super::allocation::Allocation;
use super::gpu_scene::GpuScene;
use super::layout::{BrickLayout, CacheLayout, describe_cache};
use super::light_memory::ENVIRONMENT_IMAGE;
use super::resources::{TRANSFER_FUNCTION, VOLUME};
use super::variant::Variant;
use crate::bytes::human;
use crate::error::{Error, MemoryError, Result};
use crate::gpu::{Device, DeviceSummary, Memory, ResourceBytes};
use crate::scene::volume::Volume;
use crate::scene::{self, CacheFormat, CacheScale, Scene};

/// Every resource and its bytes, in order of allocation; all are alive at once.
#[derive(Debug, Clone, PartialEq, serde::Serialize)]
pub struct Plan {
    pub resources: Vec<ResourceBytes>,
    #[serde(skip)]
    pub variant: Variant,
    /// How the volume is cut into bricks, if it does not fit.
    #[serde(skip)]
    pub bricks: Option<BrickLayout>,
}

/// The variant to render with, and why.
#[derive(Debug, Clone, PartialEq)]
pub struct Choice {
    pub plan: Plan,
    /// Why, as the end of a sentence: "caching, because …".
    pub reason: String,
    /// What the next better variant would need.
    pub next_better: String,
}

impl Plan {
    /// Plans a scene. Fails where the device's limits, not its free memory, are in the way.
    pub fn new(device: &Arc<Device>, limits: &DeviceSummary, scene: &GpuScene) -> Result<Plan> {
        let dry_run = Memory::dry_run(device, limits.clone());
        Allocation::make(&dry_run, scene)?;
        Ok(Plan {
            resources: dry_run.resources_at_peak(),
            variant: scene.variant.clone(),
            bricks: scene.bricks,
        })
    }

    pub fn bytes(&self) -> u64 {
        self.resources.iter().map(|r| r.bytes).sum()
    }
}

/// A cache that the scene allows.
pub(super) struct Rung {
    pub scale: f64,
    pub format: CacheFormat,
    /// Fails where the device's images are too small.
    pub layout: Result<CacheLayout, MemoryError>,
}

/// The caches that the scene allows, best first.
pub(super) fn rungs(
    uncached: &GpuScene,
    volume: &Volume,
    scene: &Scene,
    limits: &DeviceSummary,
) -> impl Iterator<Item = Rung> + use<> {
    let scales = match scene.render.cache_scale {
        CacheScale::Auto => vec![1.0, 0.5, 0.25, COARSEST],
        CacheScale::Fixed(scale) => vec![scale],
    };
    let formats = match scene.render.cache_format {
        CacheFormat::Auto => vec![CacheFormat::F32, CacheFormat::F16],
        format => vec![format],
    };
    let occupancy = uncached.occupancy(volume);
    let (dims, most) = (volume.dims, limits.max_image_3d);
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

/// Cells that a CPU should fill at most, unless the picture has more pixels: a cell's path costs as much as a
/// pixel's. A GPU is some hundred times as fast. The limit holds for `auto` alone: a scale that is set by name is
/// granted.
const FEW_NODES: u64 = 1 << 18;
const COARSEST: f64 = 0.125;

/// The number of the cache's cells, if the device should not fill so many.
pub(super) fn too_many_nodes(plan: &Plan, limits: &DeviceSummary, scene: &Scene) -> Option<u64> {
    let layout = plan.variant.cache()?;
    let pixels = scene.render.size.iter().map(|&n| n as u64).product::<u64>();
    let minds = limits.kind.is_software()
        && scene.render.cache_scale == CacheScale::Auto
        && layout.scale > COARSEST;
    Some(layout.active_nodes()).filter(|&cells| minds && cells > FEW_NODES.max(pixels))
}

/// The reason why a cache is of no use to the scene, if there is one.
pub(super) fn useless(scene: &Scene) -> Option<&'static str> {
    let medium = scene.medium.as_ref();
    if scene.render.max_bounces > 0 {
        Some("render.max_bounces is set, and a cache holds light after any number of bounces")
    } else if medium.is_none_or(|m| m.density <= 0.0 || m.transfer.iter().all(|p| p.opacity <= 0.0))
    {
        Some("no medium scatters light that a cache could hold")
    } else {
        None
    }
}

/// Whether a cache is looked for.
pub(super) fn wants_cache(scene: &Scene) -> bool {
    match scene.render.variant {
        scene::Variant::Caching => true,
        scene::Variant::Auto => useless(scene).is_none(),
        scene::Variant::NonCaching | scene::Variant::Published => false,
    }
}

/// The best variant that stays within `budget` bytes and the device's limits with the volume whole.
pub(super) fn choose_whole(
    device: &Arc<Device>,
    limits: &DeviceSummary,
    budget: u64,
    volume: &Volume,
    scene: &Scene,
) -> Result<Choice> {
    let wanted = scene.render.variant;
    let uncached = GpuScene::new(scene, volume, 0);
    let without_cache = || Plan::new(device, limits, &uncached).map_err(with_remedy);
    let without = |reason: String, next_better: String| {
        Ok(Choice {
            plan: fitting(without_cache()?, budget, None)?,
            reason,
            next_better,
        })
    };
    match (wanted, useless(scene)) {
        (scene::Variant::NonCaching | scene::Variant::Published, _) => {
            return without("it was asked for".into(), "not looked for".into());
        }
        (scene::Variant::Auto, Some(why)) => {
            return without(why.into(), "none is of use here".into());
        }
        _ => {}
    }
    let mut better = Vec::new();
    for rung in rungs(&uncached, volume, scene, limits) {
        let name = describe_cache(rung.scale, rung.format);
        let layout = rung.layout.map_err(Error::from);
        let cached = layout.map(|layout| uncached.clone().with_cache(layout));
        let planned = cached.and_then(|cached| Plan::new(device, limits, &cached));
        match why_not(&planned, budget, limits, scene) {
            Some(why) => better.push(format!("{name} {why}")),
            None => {
                let plan = planned?;
                return Ok(Choice {
                    reason: reason(&plan, wanted, &better),
                    next_better: better.pop().unwrap_or("there is none".into()),
                    plan,
                });
            }
        }
    }
    if wanted == scene::Variant::Caching {
        let without = fitting(without_cache()?, budget, better.last().cloned())?;
        let smallest_cache = better.pop().unwrap_or_default();
        return Err(no_cache(&without, budget, smallest_cache).into());
    }
    let next_better = better.pop().unwrap_or_default();
    Ok(Choice {
        plan: fitting(without_cache()?, budget, Some(next_better.clone()))?,
        reason: format!("no cache fits: {next_better}"),
        next_better,
    })
}

/// What is in the way of a planned cache, as the end of a sentence that begins with its name. `None` for one that fits, and
/// for errors that have nothing to do with memory.
fn why_not(
    planned: &Result<Plan>,
    budget: u64,
    limits: &DeviceSummary,
    scene: &Scene,
) -> Option<String> {
    match planned {
        Ok(plan) if let Some(cells) = too_many_nodes(plan, limits, scene) => Some(format!(
            "has {cells} cells, more than a CPU fills while it renders a picture of this size, and would take {}",
            human(plan.bytes()),
        )),
        Ok(plan) if plan.bytes() > budget => Some(format!("needs {}", needs(plan.bytes()))),
        Err(Error::Memory(why)) => Some(format!("is impossible: {why}")),
        Ok(_) | Err(_) => None,
    }
}

fn reason(plan: &Plan, wanted: scene::Variant, better: &[String]) -> String {
    let asked = match wanted {
        scene::Variant::Caching => "it was asked for, and ",
        _ => "",
    };
    let fits = format!(
        "{} takes {}",
        plan.variant.description(),
        human(plan.bytes())
    );
    match better.last() {
        None => format!("{asked}nothing better is needed: {fits}"),
        Some(why) => format!("{asked}it is the best that fits: {fits}, while {why}"),
    }
}

pub(super) fn needs(bytes: u64) -> String {
    format!("{} ({bytes} bytes)", human(bytes))
}

fn fitting(plan: Plan, budget: u64, smallest_cache: Option<String>) -> Result<Plan> {
    if plan.bytes() <= budget {
        Ok(plan)
    } else {
        Err(too_small(&plan, budget, smallest_cache).into())
    }
}

/// Adds the remedy to the error of a device that is too small even without a cache.
fn with_remedy(error: Error) -> Error {
    match error {
        Error::Memory(why) => MemoryError::Scene {
            remedy: remedy(why.resource().unwrap_or_default()),
            why: Box::new(why),
        }
        .into(),
        other => other,
    }
}

/// What makes a resource smaller, as the end of a sentence.
fn remedy(resource: &str) -> &'static str {
    match resource {
        ENVIRONMENT_IMAGE => "make the environment's image smaller",
        TRANSFER_FUNCTION => "give medium.transfer fewer points",
        VOLUME => "set volume.crop",
        _ => "lower --size, or set volume.crop",
    }
}

/// The error for a scene that asks for a cache where only the variant without one fits.
pub(super) fn no_cache(without: &Plan, budget: u64, smallest_cache: String) -> MemoryError {
    MemoryError::Cache {
        budget,
        smallest_cache,
        non_caching: without.bytes(),
    }
}

/// The error that says what is in the way and what would fit.
pub(super) fn too_small(
    without_cache: &Plan,
    budget: u64,
    smallest_cache: Option<String>,
) -> MemoryError {
    let largest = without_cache.resources.iter().max_by_key(|r| r.bytes);
    let largest = largest.expect("a plan has a picture at least");
    MemoryError::Plan {
        budget,
        variant: without_cache.variant.word(),
        is_in_bricks: without_cache.bricks.is_some(),
        needed: without_cache.bytes(),
        largest: largest.name.into(),
        largest_bytes: largest.bytes,
        smallest_cache,
        remedy: remedy(largest.name),
    }
}
