//! Positions in a lattice of bricks, or of places for them, x fastest: by their index, and packed into a word with ten
//! bits for each axis (`unpacked` in `glsl/include/cells.glsl`, `to_texel` in `glsl/include/volume_bricks.glsl`).

/// Positions along an axis that fit into ten bits.
pub const MOST: u32 = 1 << 10;

pub fn pack([x, y, z]: [u32; 3]) -> u32 {
    x | y << 10 | z << 20
}

pub fn unpack(word: u32) -> [u32; 3] {
    [word, word >> 10, word >> 20].map(|bits| bits & (MOST - 1))
}

/// The position with this index where there are so many along each axis.
pub fn position(index: u32, [width, height, _]: [u32; 3]) -> [u32; 3] {
    [
        index % width,
        index / width % height,
        index / width / height,
    ]
}
