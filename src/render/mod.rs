//! How a scene becomes a picture: the GPU's resources, one file a pass, and the frame.

mod accumulate;
mod cache;
mod cache_layout;
mod camera_march;
mod cell_tracking;
mod constants;
mod copy;
mod cut_cells;
mod delta_tracking;
mod environment_table;
mod filter_probe;
mod iso_depth;
mod macrocell_ranges;
mod majorants;
mod occupancy;
mod plan;
mod published;
mod published_march;
mod published_transport;
mod ray_march;
mod renderer;
mod resources;
pub mod shared;
mod slots;
mod tone_map;

pub use cache::Cache;
pub use cache_layout::CacheLayout;
pub use constants::{SceneBuffers, macrocells};
pub use occupancy::{Occupancy, macrocell_ranges};
pub use plan::{Choice, Plan, choose};
pub use renderer::{Film, FirstHits, Renderer, Totals};
pub use resources::{PublishedResources, Resources};
