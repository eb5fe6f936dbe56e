//! Constants that Rust and the shaders share, each defined once: `NAME: u32 as int` is a `u32` here and an `int` in GLSL.

macro_rules! constants {
    ($($(#[$about:meta])* pub const $name:ident: $rust:ty as $glsl:ident = $value:expr;)*) => {
        $($(#[$about])* pub const $name: $rust = $value;)*

        /// `const TYPE NAME = VALUE;` for each constant.
        pub fn glsl() -> String {
            [$(line(stringify!($glsl), stringify!($name), format!("{:?}", $name)),)*].concat()
        }
    };
}

fn line(glsl_type: &str, name: &str, value: String) -> String {
    let suffix = if glsl_type == "uint" { "u" } else { "" };
    format!("const {glsl_type} {name} = {value}{suffix};\n")
}

constants! {
    /// Trilinear cells along an axis of a macrocell.
    pub const MACROCELL: u32 as int = crate::scene::volume::MACROCELL;
    /// Nodes of the cache along an axis of a brick.
    pub const BRICK: u32 as int = 4;
    /// Nodes of a brick, and those of them that belong to the coarse lattice.
    pub const NODES: u32 as uint = BRICK.pow(3);
    pub const COARSE_NODES: u32 as uint = NODES / 8;
    /// Floats of the sums of a node's paths: those of its light, and those of each column of its flux
    /// ([`NodeSums`](super::shared::NodeSums)).
    pub const LIGHT_FLOATS: u32 as uint = 4;
    pub const FLUX_FLOATS: u32 as uint = 3;
    /// 32-bit words of a brick: `RIM_WORDS` with one bit for each cube, and `CUT_WORDS` with one bit for each cube and then
    /// two for each node (`cube_bits.glsl`, `pages.glsl`).
    pub const RIM_WORDS: u32 as uint = NODES / u32::BITS;
    pub const CUT_WORDS: u32 as uint = 3 * RIM_WORDS;
    /// Relative rounding of an interpolated value: it may leave the range of the voxels around by so much. Along each axis,
    /// a difference, a product and a sum round by 2, 2 and 1 times 2⁻²⁴ of the largest voxel: 15·2⁻²⁴ in all.
    pub const INTERPOLATION_ROUNDING: f32 as float = 1e-6;
    /// Transmittance below which nothing behind can be seen in eight bits.
    pub const OPAQUE_BELOW: f32 as float = 1e-3;
    /// Iterations after which lavapipe silently ends a loop, counted for a group of eight threads, whose iterations may add
    /// up.
    pub const LAVAPIPE_ITERATIONS: u32 as uint = 65535;
    /// The result of ray_march.comp: the picture; or only the light that the medium scatters towards the camera, from the
    /// cache and without the suns' own; or that light without the cubes that a picture at rest leaves to paths.
    pub const MARCH_PICTURE: u32 as uint = 0;
    pub const MARCH_CACHED: u32 as uint = 1;
    pub const MARCH_AT_REST: u32 as uint = 2;
    /// A cube of the cache at a face of the box or at a clip plane is at the rim if the medium's optical depth across it
    /// exceeds this (rim_cubes.comp): 0.15 across the cubes twice as wide with which bricks begin (coarse.glsl).
    pub const RIM_DEPTH: f32 as float = 0.075;
    /// A dense medium ends between two neighbouring voxels if their extinctions, times the longest side of a voxel, differ
    /// by more than this (rim_cubes.comp). Clouds whose extinction is smooth stay below.
    pub const JUMP_DEPTH: f32 as float = 0.4;
    /// It ends at a voxel, too, if these differences to the voxels before and behind it differ from each other by more than
    /// this. In a cloud, extinction may rise as steeply as at an edge, but it does not begin to do so all at once.
    pub const BEND_DEPTH: f32 as float = 0.28;
    /// If the optical depth of a voxel at the majorant exceeds this, the steps of a march adapt to the extinction that is
    /// found along the ray, instead of to the majorant (march.glsl).
    pub const DENSE_DEPTH: f32 as float = 2.0;
    /// Number of equal bins of stored values; for each, a table lists the transfer function's points that a lookup in it may
    /// need (parts/transfer_table.rs).
    pub const TRANSFER_BINS: u32 as int = 512;
    /// Patches along either side of the picture, however many pixels it has.
    pub const PATCHES: u32 as int = 32;
    /// Stand in for a surface's index as the event that ends a flight: `NOTHING`, the ray leaves the clipped box;
    /// `COLLISION`, it collides in the medium. As the surface on which a ray starts, `NOTHING` means none.
    pub const NOTHING: i32 as int = -1;
    pub const COLLISION: i32 as int = -2;
    pub const SHADING_LAMBERT: u32 as uint = 0;
    pub const SHADING_PHONG: u32 as uint = 1;
    pub const SHADING_DISNEY: u32 as uint = 2;
    /// The slot has no path.
    pub const STAGE_IDLE: u32 as uint = 0;
    /// The path is on its way to a collision, a surface or the sky.
    pub const STAGE_FLIGHT: u32 as uint = 1;
    /// The path's shadow ray is on its way to a light.
    pub const STAGE_SHADOW: u32 as uint = 2;
    /// A flight has ended: the collision, surface or sky at its end is handled next.
    pub const STAGE_ARRIVAL: u32 as uint = 3;
    /// Searches for surfaces that a path has put off: its shadow ray's, which comes first, and its flight's.
    pub const SEARCH_SHADOW: u32 as uint = 1;
    pub const SEARCH_FLIGHT: u32 as uint = 2;
    /// Page-table entry of a cache brick without memory. Its place bits are zero, so that a read through it reads the first
    /// place.
    pub const NO_PLACE: u32 as uint = 0x8000_0000;
    /// The page of a volume brick that is on the GPU, and of one that has been read there lately.
    pub const PAGE_RESIDENT: u32 as uint = 0x8000_0000;
    pub const PAGE_READ: u32 as uint = 0x4000_0000;
    /// Places for bricks of the volume along the z axis of an image, at most. A page counts them through all images, as if
    /// each had so many.
    pub const PLACES_DEEP: u32 as int = 64;
    /// The number of a node's first paths that end where they can gather cached light (gathering.glsl). In most
    /// bricks they are paths of the coarse lattice (coarse.glsl).
    pub const GATHERED: u32 as uint = 32;
    /// The nodes of a brick that a batch fills: all; all, for the first time, so that nodes that are not filled yet may
    /// hold the light of an older scene; or those of the coarse lattice.
    pub const FILLED_ALL: u32 as uint = 0;
    pub const FILLED_FIRST: u32 as uint = 1;
    pub const FILLED_COARSE: u32 as uint = 2;
    /// Value of `nodes_half` for all nodes at once; 0 and 1 select the nodes whose indices have an even or an odd sum.
    pub const BOTH_HALVES: u32 as uint = 2;
    /// Gathered paths that count as much as one traced path. They share the errors of what they read with all their
    /// neighbours; the sooner these are forgotten, the better. (`transport caching::gathering` prints the noise that
    /// would be left if one counted for one.)
    pub const GATHERED_FOR_ONE: u32 as uint = 4;
    /// Height of the strips in which pixels are worked off where the volume streams.
    pub const STRIP_HEIGHT: u32 as uint = 32;
    /// Sample indices by which random numbers are drawn, so that no two kinds of paths share any: those of a pixel's samples
    /// begin at 0; those of its tails here, several for each sample; this one is for what all samples of a pixel share; and
    /// those of the cache's nodes begin here.
    pub const TAIL_SAMPLES: u32 as uint = 1 << 30;
    pub const OF_ALL_SAMPLES: u32 as uint = NODE_SAMPLES - 1;
    pub const NODE_SAMPLES: u32 as uint = 1 << 31;
    /// Rows of the transfer function's image (`parts/transfer_table.rs`).
    pub const TRANSFER_SEGMENTS: u32 as int = 0;
    pub const TRANSFER_COLORS: u32 as int = 1;
    pub const TRANSFER_INTEGRALS: u32 as int = 2;
    pub const TRANSFER_CANDIDATES: u32 as int = 3;
    /// Angles of view, evenly spaced in their cosine, for which a surface's reflectance is in a table.
    pub const REFLECTANCE_ANGLES: u32 as uint = 32;
    /// Positions at which the device's filter is probed.
    pub const PROBE_POSITIONS: u32 as uint = 4096;
}
