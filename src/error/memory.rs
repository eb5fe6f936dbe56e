//! Memory that is not there: the budget's, the device's limits, or the driver's.

use super::{Error, Result};
use crate::bytes::human;

#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
pub enum MemoryError {
    /// No plan stays within the budget.
    #[error(
        "the budget is {budget} bytes, but {variant}{} needs {} ({needed} bytes), {} of it for the {largest}{}",
        if *.is_in_bricks { " with the volume in bricks" } else { "" },
        human(*.needed), human(*.largest_bytes), after_semicolon(.smallest_cache)
    )]
    Plan {
        budget: u64,
        variant: &'static str,
        /// Whether the volume streams.
        is_in_bricks: bool,
        needed: u64,
        /// The resource that takes most.
        largest: String,
        largest_bytes: u64,
        /// What the smallest cache needs, where one was considered.
        smallest_cache: Option<String>,
    },
    /// A cache was asked for by name, and only a picture without one fits.
    #[error(
        "no cache that was asked for fits into the budget of {budget} bytes; {smallest_cache}, and non-caching \
         needs {} ({non_caching} bytes)", human(*.non_caching)
    )]
    Cache {
        budget: u64,
        smallest_cache: String,
        /// Whether there is a smaller one, which was not asked for.
        has_smaller: bool,
        non_caching: u64,
    },
    /// What the window leaves of the budget is too little.
    #[error("beside {} of the window itself, {why}", human(*.window))]
    BesideWindow { window: u64, why: Box<MemoryError> },
    /// A resource is more than what is left of the budget.
    #[error(
        "{resource} needs {}, but {} of the budget of {} are in use", human(*.bytes), human(*.used), human(*.budget)
    )]
    Budget {
        resource: String,
        bytes: u64,
        used: u64,
        budget: u64,
    },
    /// A resource is larger than what the device allocates at once.
    #[error("{resource} needs {}, but {device} allocates at most {} at once", human(*.bytes), human(*.limit))]
    Allocation {
        resource: String,
        bytes: u64,
        device: String,
        limit: u64,
    },
    /// A buffer is larger than a shader can see.
    #[error("{resource} needs {}, but {device} takes buffers of at most {}", human(*.bytes), human(*.limit))]
    Buffer {
        resource: String,
        bytes: u64,
        device: String,
        limit: u64,
    },
    /// An image is longer than the device's images are.
    #[error("{resource} is {texels} texels long, but {device} takes at most {limit} a side")]
    Image {
        resource: String,
        texels: u32,
        device: String,
        limit: u32,
    },
    /// The cache that was asked for is beyond the device's limits.
    #[error("a cache at scale {scale} is impossible: {why}")]
    CacheScale {
        scale: String,
        /// Whether there is a coarser one, which was not asked for.
        has_coarser: bool,
        why: Box<MemoryError>,
    },
    /// A cache has more nodes along an axis than can be addressed.
    #[error("its {nodes:?} nodes are more than {limit} along an axis")]
    CacheNodes { nodes: [u32; 3], limit: u32 },
    /// A cache's bricks do not fit into the largest image.
    #[error(
        "its {bricks} bricks of nodes are more than a 3D image of {texels} texels a side holds"
    )]
    CacheBricks { bricks: usize, texels: u32 },
    /// The volume streams, and there is too little room for what one ray needs.
    #[error(
        "a single ray needs more bricks of the volume at once than the {room} that there is room for"
    )]
    VolumeBricks { room: u32 },
    /// The host has too little memory for the picture itself.
    #[error(
        "a picture of {}x{} pixels needs about {} of the host's memory, and {} are free{}", size[0], size[1],
        human(*.bytes), human(*.free), less(*.planned)
    )]
    Picture {
        size: [u32; 2],
        bytes: u64,
        free: u64,
        /// Bytes of those that are planned for bricks, and for the device where it is a CPU.
        planned: u64,
    },
    /// The driver had no memory although the plan was within its limits.
    #[error("{resource} ({}) could not be allocated on {device} ({why})", human(*.bytes))]
    Refused {
        resource: String,
        bytes: u64,
        device: String,
        why: String,
    },
    /// The device ran out of memory.
    #[error("the device has no memory left ({what})")]
    Device { what: String },
    /// The machine ran out of memory.
    #[error("the machine has no memory left ({what})")]
    Host { what: String },
}

impl MemoryError {
    /// Whether it is known that a picture of fewer pixels takes less. (Why a driver has no memory is not known.)
    pub fn depends_on_size(&self) -> bool {
        match self {
            MemoryError::BesideWindow { why, .. } => why.depends_on_size(),
            MemoryError::Plan { .. }
            | MemoryError::Budget { .. }
            | MemoryError::Allocation { .. }
            | MemoryError::Buffer { .. }
            | MemoryError::Image { .. }
            | MemoryError::Cache { .. }
            | MemoryError::VolumeBricks { .. }
            | MemoryError::Picture { .. } => true,
            MemoryError::CacheScale { .. }
            | MemoryError::CacheNodes { .. }
            | MemoryError::CacheBricks { .. }
            | MemoryError::Refused { .. }
            | MemoryError::Device { .. }
            | MemoryError::Host { .. } => false,
        }
    }
}

fn less(planned: u64) -> String {
    if planned > 0 {
        format!(
            ", of which {} are planned for other purposes",
            human(planned)
        )
    } else {
        String::new()
    }
}

fn after_semicolon(text: &Option<String>) -> String {
    text.as_ref()
        .map_or(String::new(), |text| format!("; {text}"))
}

/// `None` where the device's limits or its memory refuse what was planned.
pub fn unless_refused<T>(planned: Result<T>) -> Result<Option<T>> {
    match planned {
        Ok(planned) => Ok(Some(planned)),
        Err(Error::Memory(_)) => Ok(None),
        Err(other) => Err(other),
    }
}
