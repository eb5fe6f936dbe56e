//! Is the light right? Renders in process, on whatever device there is, under Vulkan's validation layers.
//!
//! `tests/README.md` says which promise is tested where.

#[path = "../support/mod.rs"]
mod support;

mod bricks;
mod caching;
mod closed_form;
mod edits;
mod faults;
mod hard_cases;
mod isosurface;
mod memory_plan;
mod mitsuba;
mod oracle_gpu;
mod oracle_self;
mod passes;
mod published;
mod samplers;
mod soak;
mod trial;
mod twins;
