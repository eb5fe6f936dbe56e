//! How a scene becomes a picture.
//!
//! A [`GpuScene`] is what shaders read of a scene: its [`Parts`], which change independently, and the [`Variant`] that
//! renders it. A [`Plan`] adds up the GPU memory of that in advance, by a dry run of the statements that allocate. A
//! [`Renderer`] has it on the GPU: the resources that every variant needs, and an estimator, which is a variant's passes
//! together with its own memory. Each pass is a file here and a shader of the same name in `glsl/`.
//!
//! A frame, as [`Renderer`] runs it: the majorants of the medium (once a transfer function), then how near and how far
//! the camera's rays meet anything (`patches`, once a view), then, with a cache, batches of paths from its nodes, and then
//! unit after unit of samples, each folded into the mean (`accumulate`). `iso_depth` adds the picture's other layers,
//! `tone_map` encodes it for a display.
//!
//! # Words
//!
//! The same word means the same thing in Rust, in GLSL and in messages.
//!
//! In a picture:
//! - **sample**: one estimate of a pixel's radiance, by a path or by a march.
//! - **unit**: the samples that every pixel gets between two updates of its mean. A picture is only taken at the end of a
//!   unit, and the spread between units gives its standard error.
//! - **bundle**: units that are worked off together, pixel by pixel, where the volume streams.
//! - **item**: a unit of a pixel.
//! - **patch**: one of 32 × 32 rectangles of the picture. For each it is known how near and how far its rays meet
//!   anything.
//!
//! In the volume:
//! - **cell**: the cube between eight neighbouring voxels, in which the field is one trilinear polynomial.
//! - **macrocell**: 8³ cells, with the smallest and the largest value in them.
//! - **block**: one or more macrocells that share a majorant, the largest extinction anywhere in them.
//! - **volume brick**: 32³ voxels and those behind them, of a volume that does not fit; a part of them has places in an
//!   image on the device.
//! - **stretch**: the part of a ray in up to eight blocks in a row that hold medium; a march chooses its step for each.
//!
//! In the cache:
//! - **node**: a point at which the cache keeps light. Statistics and users' messages call it a cell of the cache.
//! - **cube**: the space between eight neighbouring nodes, in which light is interpolated.
//! - **brick**: 4³ nodes, which have memory together or not at all.
//! - **place**: the position of a brick in the cache's images; the page table says which brick has which place.
//! - **batch**: the paths that all nodes get between two looks at the error.
//! - **update**: one path of a node.
//!
//! On the GPU:
//! - **slot**: a thread's room for one path in flight. It takes the next pixel or node when its path has ended.

mod accumulate;
mod allocation;
mod brick_layout;
mod brick_places;
mod brick_window;
mod bundle;
mod cache;
mod cache_error;
mod cache_layout;
mod cache_memory;
mod cache_progress;
mod cache_state;
mod caching;
mod camera_march;
mod cell_tracking;
mod choice;
mod codes;
mod copy;
mod cube_bits;
mod cut_cells;
mod delta_tracking;
mod estimator;
pub mod features;
mod film;
mod filter_probe;
mod focus;
mod gpu_scene;
mod host_bricks;
mod iso_depth;
mod light_memory;
mod majorants;
mod marched;
mod needed_bricks;
mod occupancy;
mod pace;
mod packed;
mod parts;
mod pass_compiler;
mod patches;
mod path_queue;
mod peak;
mod peak_rate;
mod place_bricks;
mod plan;
mod plan_in_bricks;
mod published;
mod published_cells;
mod published_march;
mod published_transport;
mod ray_march;
mod reflectance;
mod renderer;
mod repeated_pass;
mod resources;
mod rim_cubes;
pub mod shared;
mod spread_light;
mod sums;
mod tail_tracking;
mod tone_map;
mod totals;
mod units;
mod until;
mod upload;
mod variant;
mod volume_bricks;

pub use brick_layout::BrickLayout;
pub use brick_places::BrickFigures;
pub use cache::Cache;
pub use cache_layout::CacheLayout;
pub use cache_state::CacheState;
pub use caching::Caching;
pub use choice::{caches, choose};
pub use copy::{Sink, Source};
pub use film::{Film, FirstHits};
pub use filter_probe::filter_error;
pub use gpu_scene::GpuScene;
pub use needed_bricks::needed_bricks;
pub use occupancy::Occupancy;
pub use pace::{doubling, gathers, worth};
pub use parts::{Changes, Derived, Part, Parts};
pub use peak::Peak;
pub use peak_rate::{PeakRates, peak, peak_rates};
pub use plan::{Choice, Plan};
pub use ray_march::RAYS;
pub use renderer::Renderer;
pub use resources::Resources;
pub use sums::Sums;
pub use tone_map::ToneMapPush;
pub use totals::Totals;
pub use until::Until;
pub use variant::Variant;
