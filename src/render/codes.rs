//! Named integers that Rust and the shaders share: in GLSL, `const uint NAME`.

macro_rules! codes {
    ($($(#[$about:meta])* pub const $name:ident: u32 = $value:expr;)*) => {
        $($(#[$about])* pub const $name: u32 = $value;)*
        const CODES: &[(&str, u32)] = &[$((stringify!($name), $name),)*];
    };
}

codes! {
    pub const SHADING_LAMBERT: u32 = 0;
    pub const SHADING_PHONG: u32 = 1;
    pub const SHADING_DISNEY: u32 = 2;
    /// The slot has no path.
    pub const STAGE_IDLE: u32 = 0;
    /// The path is on its way to a collision, a surface or the sky.
    pub const STAGE_FLIGHT: u32 = 1;
    /// The path's shadow ray is on its way to a light.
    pub const STAGE_SHADOW: u32 = 2;
    /// A flight has ended: the collision, surface or sky at its end is handled next.
    pub const STAGE_ARRIVAL: u32 = 3;
    /// Searches for surfaces that a path has put off: its shadow ray's, which comes first, and its flight's.
    pub const SEARCH_SHADOW: u32 = 1;
    pub const SEARCH_FLIGHT: u32 = 2;
    /// The page table's entry of a brick without memory. Its bits for a place are those of the first place.
    pub const NO_PLACE: u32 = 0x8000_0000;
    /// The page of a volume brick that is on the GPU, and of one that has been read there lately.
    pub const PAGE_RESIDENT: u32 = 0x8000_0000;
    pub const PAGE_READ: u32 = 0x4000_0000;
    /// The number of a node's first paths that end where they can gather cached light (gathering.glsl). In most
    /// bricks they are paths of the coarse lattice (coarse.glsl).
    pub const GATHERED: u32 = 32;
    /// All nodes of a brick are filled; all for the first time, so that those whose turn has not come may hold the light of an
    /// older scene; or only those of the coarse lattice.
    pub const FILLED_WHOLE: u32 = 0;
    pub const FILLED_FIRST: u32 = 1;
    pub const FILLED_COARSE: u32 = 2;
    /// In the place of a half of the cache's nodes, whose indices have an even (0) or odd (1) sum: all nodes at once.
    pub const BOTH_HALVES: u32 = 2;
    /// Gathered paths that count as much as one traced path. They share the errors of what they read with all their
    /// neighbours; the sooner these are forgotten, the better. (`transport caching::gathering` prints the noise that
    /// would be left if one counted for one.)
    pub const GATHERED_FOR_ONE: u32 = 4;
    /// Height of the strips in which pixels are worked off where the volume streams.
    pub const STRIP_HEIGHT: u32 = 32;
    /// Angles of view, evenly spaced in their cosine, for which a surface's reflectance is in a table.
    pub const REFLECTANCE_ANGLES: u32 = 32;
    /// Positions at which the device's filter is probed.
    pub const PROBE_POSITIONS: u32 = 4096;
}

pub fn glsl() -> String {
    let line = |(name, value): &(&str, u32)| format!("const uint {name} = {value}u;\n");
    CODES.iter().map(line).collect()
}
