//! What the command line says about errors, budgets and ends of renders: the library's facts, in terms of the flags by which
//! the user sets them.

use crate::engine::{BudgetSource, Limit, StopReason};
use crate::error::{DeviceError, Error, Lacking, MemoryError};
use crate::render::{ENVIRONMENT_IMAGE, TRANSFER_FUNCTION, UNIT_SUM, VOLUME_IMAGES};

/// One sentence with the fact and its remedy.
pub fn message(error: &Error) -> String {
    match error {
        Error::Memory(why) => match remedy(why, "--size") {
            Some(remedy) => format!("{why}: {remedy}"),
            None => why.to_string(),
        },
        Error::Device(why @ (DeviceError::NotFound { .. } | DeviceError::Lacks { .. })) => {
            format!("--device {why}")
        }
        Error::Device(why @ DeviceError::ShowsNothing { .. }) => {
            format!("{why}; choose another --device")
        }
        Error::TooShort { time, lacking, .. } => {
            let time = time.as_secs_f64();
            format!(
                "--time {time}: {error}; allow more time{}",
                or_else(*lacking)
            )
        }
        other => other.to_string(),
    }
}

/// Why a render has stopped, as the end of the sentence "stopped because …".
pub fn why_stopped(reason: &StopReason) -> String {
    match reason {
        StopReason::Spp(count) => format!("--spp {count} is reached"),
        StopReason::Shard(range) => format!("--samples {range} are done"),
        other => other.to_string(),
    }
}

/// Where a budget comes from, as the end of a sentence.
pub fn budget_source(source: BudgetSource) -> String {
    let flag = |limit| match limit {
        Limit::Bytes(_) => "--vram-budget".to_string(),
        Limit::Percent(share) => format!("--vram-budget, {share} % of the heap"),
    };
    match source {
        BudgetSource::Driver(source) => source.into(),
        BudgetSource::Limit(limit) => flag(limit),
        BudgetSource::Heap(limit) => format!("the heap, which is smaller than {}", flag(limit)),
        BudgetSource::Host => "half of the host's free memory, which the device shares".into(),
    }
}

/// Further remedies where `--time` was too short.
fn or_else(lacking: Lacking) -> &'static str {
    match lacking {
        Lacking::CachePaths => ", a coarser cache (--cache-scale), or none (--variant non-caching)",
        Lacking::Sample => {
            " or fewer pixels, or shorten paths by render.max_bounces or by a lower medium.density"
        }
        Lacking::SampleThroughCache => " or fewer pixels",
    }
}

/// What lets a picture be made with the memory that there is; `None` where a resource does not tell. `size` is the flag that
/// sets the picture's size.
fn remedy(error: &MemoryError, size: &str) -> Option<String> {
    let remedy = match error {
        MemoryError::Plan { largest, .. } => {
            return Some(format!(
                "raise --vram-budget, or {}",
                smaller(largest, size)
            ));
        }
        MemoryError::BesideWindow { why, .. } => return remedy(why, WINDOW),
        MemoryError::Budget { resource, .. } if resource.starts_with(OF_WINDOW) => {
            return Some(format!("raise --vram-budget, or lower {WINDOW}"));
        }
        MemoryError::Cache {
            has_smaller: true, ..
        } => {
            "raise --vram-budget, allow a smaller --cache-scale or --cache-format, or choose --variant auto"
        }
        MemoryError::Cache { .. } => "raise --vram-budget, or choose --variant auto",
        MemoryError::Budget { .. } => {
            "raise --vram-budget, or crop the volume or shrink the picture"
        }
        MemoryError::Allocation { resource, .. }
        | MemoryError::Buffer { resource, .. }
        | MemoryError::Image { resource, .. } => return Some(smaller(resource, size)),
        MemoryError::CacheScale {
            has_coarser: true, ..
        } => "lower --cache-scale, or choose --variant auto",
        MemoryError::CacheScale { .. } => "choose --variant auto",
        MemoryError::CacheNodes { .. } | MemoryError::CacheBricks { .. } => return None,
        MemoryError::VolumeBricks { .. } => {
            return Some(format!("raise --vram-budget or lower {size}"));
        }
        MemoryError::Picture { .. } => return Some(format!("lower {size}")),
        MemoryError::Refused { .. } => "lower --vram-budget",
        MemoryError::Device { .. } => {
            "lower --vram-budget, or close other programs that use the device"
        }
        MemoryError::Host { .. } => "close other programs, or lower --ram-budget",
    };
    Some(remedy.into())
}

/// The flag that sets the size of a picture in the window.
const WINDOW: &str = "--window";

/// How the names of the window's own resources begin (`src/gpu/window`).
const OF_WINDOW: &str = "window: ";

/// What makes a resource smaller.
fn smaller(resource: &str, size: &str) -> String {
    match resource {
        of_window if of_window.starts_with(OF_WINDOW) => format!("lower {WINDOW}"),
        ENVIRONMENT_IMAGE => "make the environment's image smaller".into(),
        TRANSFER_FUNCTION => "give medium.transfer fewer points".into(),
        volume if VOLUME_IMAGES.contains(&volume) => "set volume.crop".into(),
        UNIT_SUM => format!("lower {size}"),
        _ => format!("lower {size}, or set volume.crop"),
    }
}
