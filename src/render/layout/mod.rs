//! Where bricks lie, those of the cache and those of a volume that does not fit: how many there are, and which of them have
//! places in images. It is worked out on the CPU, since a plan has to know all sizes before anything is on the GPU.

mod bricks;
mod cache;
mod occupancy;

pub use bricks::{BrickLayout, Place};
pub use cache::{CacheLayout, describe_cache};
pub use occupancy::Occupancy;
