//! How a scene becomes a picture: the GPU's resources, one file a pass, and the frame.

mod accumulate;
mod constants;
mod copy;
mod delta_tracking;
mod environment_table;
mod filter_probe;
mod iso_depth;
mod macrocell_ranges;
mod majorants;
mod plan;
mod renderer;
mod resources;
pub mod shared;

pub use constants::SceneBuffers;
pub use plan::Plan;
pub use renderer::{Film, FirstHits, Renderer, Totals};
pub use resources::Resources;
