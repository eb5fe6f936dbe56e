//! How a scene becomes a picture.
//!
//! A [`GpuScene`] is what shaders read of a scene: its [`Parts`], which change independently, and the [`Variant`] that
//! renders it. A [`Plan`] adds up the GPU memory of that in advance, by a dry run of the statements that allocate. A
//! [`Renderer`] has it on the GPU: the resources that every variant needs, and an estimator, which is a variant's
//! passes together with its own memory. Each pass is a file here and a shader of the same name in `glsl/`
//! (`delta_tracking.rs` has two shaders: with a cache, its paths are those of `cached_tracking.comp`). What belongs to
//! one variant alone stands in a folder, `cache` or `published`, what streams a volume in `bricks`, what samples become in
//! `picture`, and what measures the device in `peak`. How large caches and volumes in bricks are, which a plan has to know,
//! is worked out in `layout`.
//!
//! A frame, as `frame.rs` runs it: the majorants of the medium (once a transfer function), then how near and how far
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
//!   unit, and the spread between units gives its standard error; where samples are marched, the change of the mean with
//!   each doubling of their number corrects it (`picture/halves.rs`).
//! - **bundle**: units that are worked off together, pixel by pixel, where the volume streams.
//! - **patch**: one of 32 × 32 rectangles of the picture. For each it is known how near and how far its rays meet
//!   anything.
//!
//! Around the volume:
//! - **sky**: the light of all environments together, their constant radiance and the image. A single one of a
//!   scene file's lights of that type is an environment.
//! - **sun**: a directional light. The cache holds one transmittance for all suns, their mean by irradiance.
//!
//! In the volume:
//! - **cell**: the cube between eight neighbouring voxels, in which the field is one trilinear polynomial.
//! - **macrocell**: 8³ cells, with the smallest and the largest value in them.
//! - **block**: one or more macrocells that share a majorant, the largest extinction anywhere in them.
//! - **volume brick**: 32³ voxels of a volume that does not fit, with the first voxels of the next bricks along each axis.
//!   Some of the bricks are in an image on the device.
//! - **needed**: a volume brick in which the medium scatters or a surface shows.
//! - **stretch**: the part of a ray in up to eight blocks in a row that hold medium; a march chooses its step for each.
//!
//! In the cache:
//! - **node**: a point at which the cache keeps light. Keys of statistics call it a cell.
//! - **cube**: the space between eight neighbouring nodes, in which light is interpolated.
//! - **brick**: 4³ nodes, which have memory together or not at all.
//! - **place**: the position of a brick in an image on the device, the cache's or the volume's; a page table says which brick
//!   has which place.
//! - **batch**: the paths that nodes get between two measurements of the cache's error; `engine/batches.rs` says how many.
//! - **update**: one path of a node.
//! - **part**: up to eight of the paths that a node gets in a batch, or a 64th of them if that is more; a **turn** is a part
//!   for each node of a brick, a **portion** the turns that are worked off together (`cache/work_list.rs`).
//! - **in sight**: bricks that a ray of the view reads, and their neighbours; each gets a share of a batch's paths
//!   (`cache/focus.rs`).
//! - **gather**: to end a path at its first collision, with the light that the cache holds there, as paths of nodes do
//!   that have had few (`gathering.glsl`).
//! - **coarse lattice**: nodes whose indices are even, of which alone a brick's first paths start (`coarse.glsl`).
//! - **guess**: a stand-in for the light of a node that is neither traced nor interpolated yet (`cache.glsl`).
//! - **cut**: a cube that a surface passes, some of whose nodes may lie behind it (`cut_cubes`).
//! - **rim**: cubes where a dense medium ends, between whose nodes light bends too much (`rim_cubes`).
//! - **tail**: the light that a march at rest leaves to paths: on surfaces, mostly without the suns' own; in cubes that are
//!   cut or at a rim; and, in `full` light, where the cache holds a guess (`tail_tracking`).
//!
//! On the GPU:
//! - **item**: what slots take from a queue: a unit of a pixel, or a part of one node's paths.
//! - **slot**: a thread's room for one path in flight. It takes the next item when it has done with the last one.
//! - **queue**: the items of a bundle or of a portion, worked off by slots, dispatch after dispatch (`path_queue.rs`).
//! - **page**: the entry of a brick in a page table: where it is in memory, if it is there.
//! - **admission**: which invocations may work while bricks of the volume are missing (`bricks/admission.rs`).

mod allocation;
mod bricks;
mod cache;
mod constants;
mod copy;
mod delta_tracking;
mod estimator;
pub mod features;
mod frame;
mod gpu_scene;
mod layout;
mod light_memory;
mod majorants;
mod packed;
mod parts;
mod pass_compiler;
mod passes;
mod patches;
mod path_queue;
mod peak;
mod picture;
mod planning;
mod published;
mod renderer;
mod resources;
pub mod shared;
mod until;
mod upload;
mod variant;
mod volume_images;
mod volume_reading;

pub use bricks::{BrickFigures, needed_bricks};
pub use cache::{
    Batch, Cache, CacheState, Caching, RAYS_PER_PIXEL, batch_gathers, equivalent_paths,
    next_batch_size,
};
pub use copy::{Sink, Source};
pub use gpu_scene::GpuScene;
pub use layout::{BrickLayout, CacheLayout, Occupancy};
pub use light_memory::ENVIRONMENT_IMAGE;
pub use parts::{Changes, Derived, Display, Part, Parts};
pub use peak::{Peak, PeakRates, filter_error, peak, peak_rates};
pub use picture::{Film, FirstHits, Halves, Sums, ToneMapPush, Totals, mean_square, variance};
pub use planning::{Choice, Plan, Planner};
pub use renderer::Renderer;
pub use resources::{Resources, TRANSFER_FUNCTION, UNIT_SUM};
pub use until::Until;
pub use variant::Variant;
pub use volume_images::VOLUME_IMAGES;
pub use volume_reading::ReadingSlices;
