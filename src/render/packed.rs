//! Positions in a lattice of bricks, or of places for them, x fastest: by their index, and packed into a word with ten
//! bits for each axis.

/// Bits for the position along an axis; the two that are left are for flags.
const BITS: u32 = 10;

/// Positions along an axis that fit into them.
pub const MOST: u32 = 1 << BITS;

pub fn pack([x, y, z]: [u32; 3]) -> u32 {
    x | y << BITS | z << (2 * BITS)
}

pub fn unpack(word: u32) -> [u32; 3] {
    [word, word >> BITS, word >> (2 * BITS)].map(|bits| bits & (MOST - 1))
}

/// `unpack` for shaders.
pub fn glsl() -> String {
    format!(
        "ivec3 unpacked(uint word) {{ return ivec3(word, word >> {BITS}u, word >> {}u) & {}; }}\n",
        2 * BITS,
        MOST - 1
    )
}

/// The position with this index where there are so many along each axis.
pub fn position(index: u32, [width, height, _]: [u32; 3]) -> [u32; 3] {
    [
        index % width,
        index / width % height,
        index / width / height,
    ]
}
