// Ranges of macrocells: boxes of MACROCELL³ trilinear cells.

// Smallest and largest stored value of the field in each macrocell.
LOADED_AS(rg32f) uniform texels3D ranges;

vec2 macrocell_range(ivec3 macrocell) {
    return texel_at(ranges, macrocell).rg;
}

// The smallest and largest stored value in a block. The field is continuous: it takes every value between the least
// and the largest of the block's macrocells.
vec2 range_of(ivec3 cell) {
    int side = int(scene.majorant_size) / MACROCELL;
    vec2 range = macrocell_range(side * cell);
    for (int z = 0; z < side; ++z) {
        for (int y = 0; y < side; ++y) {
            for (int x = 0; x < side; ++x) {
                ivec3 macrocell = side * cell + ivec3(x, y, z);
                vec2 part = macrocell_range(min(macrocell, ivec3(scene.macrocells) - 1));
                range = vec2(min(range.x, part.x), max(range.y, part.y));
            }
        }
    }
    return range;
}
