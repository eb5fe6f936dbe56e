//! Data that the CPU and the shaders of several passes share: the only definition of each struct. (What one pass alone takes,
//! as its push constants, is defined in the same way in the pass's own file.) The GLSL text is made from them, from
//! the constants in `constants.rs` and from the switches in `features.rs`, and stands behind
//! `#include "shared.glsl"`.
//!
//! *Grid space*: g = p / spacing + ½ with p from the box's low corner, so that voxel i's centre is at g = i + 1, the
//! box is [½, n + ½], and the trilinear cell floor(g) has the voxels floor(g) − 1 and floor(g) as corners, clamped at
//! the border. *Stored values* are what the GPU holds; transfer points and isovalues are converted to them, so that
//! no shader knows slope or intercept.

#![allow(non_camel_case_types)]

use super::constants;
use super::features::Features;
use super::packed;
use crate::gpu::Specialization;
use crate::gpu::types::*;
use crate::shared;

pub use super::constants::*;

shared! {
    all STRUCTS:

    /// The constants of a scene.
    pub struct SceneConstants {
        /// Voxels along each axis.
        pub dims: uvec3,
        /// Macrocells along each axis.
        pub macrocells: uvec3,
        /// Blocks along each axis; each has a majorant.
        pub blocks: uvec3,
        /// Sides of those blocks in trilinear cells: macrocells times a power of two.
        pub block_size: float,
        /// World units per voxel.
        pub spacing: vec3,
        /// Half the box's sides, world units.
        pub half_extent: vec3,
        /// Stored value of a texel that reads 1: 255, 65535, or 1 for f32.
        pub stored_max: float,
        /// σt where opacity is 1, per world unit.
        pub density: float,
        /// Henyey–Greenstein asymmetry.
        pub g: float,
        /// Columns of the transfer function from which values are interpolated.
        pub transfer_segments: uint,
        /// The stored value at which bins of values begin, and how many there are in a unit (parts/transfer_table.rs).
        pub transfer_bins: vec2,
        /// Colour of all points of the transfer function if `has_one_color`.
        pub color: vec3,
        /// If `is_linear`: the stored value at the lower end of the line, the opacity there, and the slope.
        pub linear_opacity: vec3,
        /// Collisions and reflections on a path; 0 = no limit.
        pub max_bounces: uint,
        /// Selects the random sequences; any value.
        pub seed: uint,
        /// Pixels.
        pub size: uvec2,
        /// Not 0: rays go through the middle of each pixel.
        pub through_centres: uint,
        /// Where the camera's rays start, in world space: the eye, or a point ahead of it at that distance (`parts/view.rs`). Those
        /// of a perspective camera then start in the plane through that point.
        pub start: vec3,
        pub start_distance: float,
        /// Unit direction into the picture.
        pub forward: vec3,
        /// From the picture's centre to its right edge, at distance 1 (perspective) or in world
        /// units (orthographic).
        pub right: vec3,
        /// From the picture's centre to its top edge, in the same unit.
        pub up: vec3,
        /// Constant part of the environment.
        pub environment: vec3,
        /// Mean radiance of the environment with its image, in units of `cache_unit`.
        pub sky: vec3,
        /// Probability that next-event estimation picks the environment image over a sun: 1 without
        /// suns, 0 without an image.
        pub image_probability: float,
        /// Cells of the environment's sampling table along u and v.
        pub image_cells: uvec2,
        /// Radiance of rays that meet nothing if `background_is_color`.
        pub background: vec3,
        /// Σ over the suns of the mean of irradiance/cache_unit over channels.
        pub suns_grey: float,
        /// Nodes of the cache along each axis.
        pub cache_nodes: uvec3,
        /// Distance from node to node, in grid units.
        pub cache_step: vec3,
        /// Places for bricks in the cache's images along each axis.
        pub cache_places: uvec3,
        /// Voxels from one node to the next, rounded down, at least 1. A march reads the cache once every 1.5 times as many
        /// steps (taken.glsl).
        pub cache_stride: uint,
        /// Bricks of the volume along each axis, if it is cut into bricks.
        pub volume_bricks: uvec3,
        /// Log2 of the voxels along a side of a volume brick.
        pub brick_shift: uint,
        /// Radiance that the cache's images hold as 1: as much as all lights together shine, channel by channel.
        pub cache_unit: vec3,
    }

    pub struct Surface {
        /// The isovalue, a stored value.
        pub value: float,
        /// What rounding to 32 bits has taken from it, where voxels are integers and `value` is none.
        pub value_rest: float,
        pub opacity: float,
        pub color: vec3,
        /// `SHADING_*`.
        pub shading: uint,
        /// Used by Phong and Disney.
        pub specular: float,
        /// Used by Phong.
        pub shininess: float,
        /// This and all that follow are used by Disney.
        pub metallic: float,
        pub roughness: float,
        pub specular_tint: float,
        pub sheen: float,
        pub sheen_tint: float,
        pub subsurface: float,
        pub clearcoat: float,
        pub clearcoat_gloss: float,
    }

    /// Integrals of a BRDF over the directions of light (`glsl/include/reflectance.glsl`).
    pub struct Reflectance {
        /// ρ₀, the directional albedo.
        pub albedo: vec3,
        /// ρₙ.
        pub along_normal: vec3,
        /// ρₜ.
        pub along_tangent: vec3,
    }

    pub struct Sun {
        /// Unit direction in which the light travels.
        pub direction: vec3,
        /// Irradiance of a plane that faces the sun, per channel.
        pub irradiance: vec3,
        /// Cumulative probability of picking this sun or an earlier one.
        pub cumulative_probability: float,
    }

    /// Points p in world space with dot(normal, p) > offset are vacuum.
    pub struct Clip {
        pub normal: vec3,
        pub offset: float,
    }

    /// A cell of the environment's sampling table (Walker's alias method).
    pub struct EnvironmentEntry {
        /// Of a random number: below it the cell itself is taken, above it `alias`.
        pub threshold: float,
        pub alias: uint,
        /// Probability per solid angle, 1/sr, of the cell itself.
        pub pdf: float,
    }

    /// A path in flight, between two dispatches.
    pub struct Path {
        pub pixel: uint,
        /// Samples of this pixel still to begin.
        pub samples_left: uint,
        /// Index of the current sample.
        pub sample_index: uint,
        /// Random numbers used by the current sample, in blocks of four.
        pub dimension: uint,
        /// `STAGE_*`.
        pub stage: uint,
        /// Collisions and reflections so far.
        pub bounces: uint,
        /// Collisions so far.
        pub collisions: uint,
        /// Position in grid space.
        pub origin: vec3,
        /// Unit direction in world space.
        pub direction: vec3,
        /// Position of the flight along the ray, and where it ends, in world units from `origin`.
        pub t: float,
        pub t_end: float,
        /// The block at `t`.
        pub block: ivec3,
        /// The event at `t_end`: a surface's index, `NOTHING` or `COLLISION`.
        pub surface: int,
        /// The collision's stored value.
        pub value: float,
        /// Bit s is set if V ≥ the value of surface s just before the surface at the end of the flight; undefined if the
        /// flight ends elsewhere, as at a collision.
        pub inside: uint,
        pub throughput: vec3,
        /// Density of the current direction, 1/sr.
        pub pdf: float,
        pub shadow_direction: vec3,
        /// Position of the shadow ray, and where it ends, in world units from `origin`.
        pub shadow_t: float,
        pub shadow_t_end: float,
        /// The block at `shadow_t`.
        pub shadow_block: ivec3,
        /// Transmittance of the shadow ray up to `shadow_t`.
        pub shadow_transmittance: float,
        /// Radiance that the shadow ray brings if nothing is in its way, times the path's throughput.
        pub shadow_radiance: vec3,
        /// `SEARCH_*`, where the volume streams.
        pub searches: uint,
        /// The first of these searches, as in `Search` of surface.glsl; `search_t` in world units from `origin`.
        pub search_t: float,
        pub search_macrocell: ivec3,
        pub search_start_surface: int,
        pub search_is_fresh: uint,
        pub search_inside: uint,
        /// Sum of the samples of this pixel; coverage in w.
        pub sum: vec4,
        /// Where the volume streams: the item that the slot works on and the brick that it waits for, both counted from
        /// 1; 0 if there is none.
        pub item: uint,
        pub missing: uint,
    }

    /// The light that a march through a pixel leaves to paths: of a surface, or of the medium where the cache cannot give
    /// it.
    pub struct Tail {
        /// Distance along the march's ray, in world units.
        pub t: float,
        /// Weight of that light in the pixel; 0 if nothing is left.
        pub weight: float,
        /// A surface's index, or `COLLISION`.
        pub surface: int,
        /// On a surface: the bits of `Path::inside`, and whether the suns' light on it is left to paths as well. In the
        /// medium: the albedo, in 16 bits a channel.
        pub payload: uvec2,
    }

    /// A brick of the cache.
    pub struct Brick {
        /// Position in the lattice, ten bits for each axis.
        pub position: uint,
        /// What the batch under way fills: `FILLED_ALL`, `FILLED_FIRST` or `FILLED_COARSE`.
        pub filled: uint,
        /// Sum of w² over a ray's reads of the brick's light, averaged over the rays of a picture, times 2³¹, with w
        /// the weight of one read in the ray's colour.
        pub squared_weight: uint,
    }

    /// A part of the paths that each node of a brick gets in a batch.
    pub struct Turn {
        /// The brick's place.
        pub place: uint,
        /// Which of how many parts it is. All parts of a brick follow one another.
        pub part: uint,
        pub parts: uint,
        /// Paths of a node in all parts, and those that it has had before.
        pub paths: uint,
        pub paths_before: uint,
        /// The earlier paths as an equivalent number of fully traced paths (cache/pace.rs).
        pub history: float,
        /// Whether the paths gather if there is light.
        pub gathers: uint,
    }

    /// Sums over paths of a node, as in the cache's images. What the columns of the flux are depends on the medium:
    ///
    /// | medium | columns |
    /// |---|---|
    /// | anisotropic, light of several colours | the flux of each channel |
    /// | anisotropic, light of one colour | the grey flux |
    /// | isotropic, beside surfaces | the grey flux of scattered light; that of the sky's own light; (the mean of the latter, 0, 0) |
    pub struct NodeSums {
        pub light: vec4,
        pub flux: mat3,
    }

    /// The node that a slot is working on.
    pub struct SlotNode {
        /// Where the item's paths begin, in grid space: the node, or a place around it.
        pub start: vec3,
        /// How far from the node that place may be along each axis, in steps of the lattice; 0 once it is known.
        pub reach: float,
        /// Where the sums go.
        pub item: uint,
        /// Direction in which the path under way left the node.
        pub first_direction: vec3,
        /// The first shadow ray of the path under way went to a sun.
        pub shadow_is_sun: uint,
        /// Whether paths end where they may gather.
        pub gathers: uint,
        pub sums: NodeSums,
    }

    /// Counters that the shaders add to and the host reads after every dispatch, in `published` after every
    /// round; they start at zero with a queue, and all but `next` wrap around.
    pub struct Counters {
        /// The next item to hand out.
        pub next: uint,
        /// Slots that had a path on its way at the end of a dispatch, added up over dispatches.
        pub unfinished: uint,
        /// Reads of the volume by tracking: tentative collisions.
        pub lookups: uint,
        /// Paths that have ended.
        pub finished: uint,
        /// Cubes of the cache whose bit is set (cube_bits.glsl).
        pub marked_cubes: uint,
    }

    /// Lookups of the volume that marches have made since the host last asked, in more than 32 bits.
    pub struct Marched {
        pub low: uint,
        pub high: uint,
    }

    /// What host and shaders tell each other about volume bricks that are not on the GPU.
    pub struct Streaming {
        /// Invocations that have missed a brick in this dispatch.
        pub missed: uint,
        /// The least index of such an invocation.
        pub first_missed: uint,
        /// Invocations that have made progress.
        pub advanced: uint,
        /// The least index of an invocation that may work, and how many may.
        pub first: uint,
        pub count: uint,
        /// A pixel or brick with this mark is done.
        pub done_mark: uint,
        /// Units of samples that are worked off together.
        pub units: uint,
        /// The first item to be worked on (in a queue, the item that its number 0 stands for), and the first that has to wait.
        pub first_item: uint,
        pub end_item: uint,
        /// The least item that a slot is still working on.
        pub oldest_item: uint,
        /// Not 0: other voxels stand in for those of missing bricks, and no invocation waits.
        pub previews: uint,
    }

    /// A brick of the volume in the staging buffer, and its place in the image.
    pub struct BrickPiece {
        /// First byte in the buffer. Voxels follow one another, x fastest.
        pub offset: uint,
        /// First texel in the image.
        pub low: uvec3,
        /// Texels along each axis.
        pub extent: uvec3,
    }
}

/// The text of `shared.glsl`.
pub fn glsl() -> String {
    [
        packed::glsl(),
        constants::glsl(),
        Features::glsl(),
        STRUCTS.concat(),
    ]
    .concat()
}
