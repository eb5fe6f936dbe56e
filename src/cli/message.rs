//! What the command line says about errors, budgets and ends of renders: the library's facts, in terms of the flags by which
//! the user sets them.

use crate::engine::{BudgetSource, Limit, StopReason};
use crate::error::{DeviceError, Error, Lacking, MemoryError};
use crate::render::{ENVIRONMENT_IMAGE, TRANSFER_FUNCTION, UNIT_SUM, VOLUME};

/// One sentence with the fact and its remedy.
pub fn message(error: &Error) -> String {
    match error {
        Error::Memory(why) => match remedy(why) {
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
                "--time {time}: {error}; give it more time{}",
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
        BudgetSource::Host => "half of the host's free memory, since the device is a CPU".into(),
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

/// What lets a picture be made with the memory that there is; `None` where a resource does not tell.
fn remedy(error: &MemoryError) -> Option<String> {
    let remedy = match error {
        MemoryError::Plan { largest, .. } => {
            return Some(format!("raise --vram-budget, or {}", smaller(largest)));
        }
        MemoryError::BesideWindow { why, .. } => return remedy(why),
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
        | MemoryError::Image { resource, .. } => smaller(resource),
        MemoryError::CacheScale {
            has_coarser: true, ..
        } => "lower --cache-scale, or choose --variant auto",
        MemoryError::CacheScale { .. } => "choose --variant auto",
        MemoryError::CacheNodes { .. } | MemoryError::CacheBricks { .. } => return None,
        MemoryError::VolumeBricks { .. } => "raise --vram-budget or lower --size",
        MemoryError::Picture { .. } => "lower --size",
        MemoryError::Refused { .. } => "lower --vram-budget",
        MemoryError::Device { .. } => "lower --vram-budget, or close what else uses the device",
        MemoryError::Host { .. } => "close what else uses it, or lower --ram-budget",
    };
    Some(remedy.into())
}

/// What makes a resource smaller.
fn smaller(resource: &str) -> &'static str {
    match resource {
        ENVIRONMENT_IMAGE => "make the environment's image smaller",
        TRANSFER_FUNCTION => "give medium.transfer fewer points",
        VOLUME => "set volume.crop",
        UNIT_SUM => "lower --size",
        _ => "lower --size, or set volume.crop",
    }
}
