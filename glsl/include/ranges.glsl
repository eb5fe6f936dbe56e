// Ranges of macrocells: boxes of MACROCELL³ trilinear cells.

#include "scene.glsl"

// Smallest and largest stored value of the field in each macrocell.
LOADED_AS(rg32f) uniform texels3D ranges;

vec2 macrocell_range(ivec3 macrocell) {
    return texel_at(ranges, macrocell).rg;
}

// The smallest and largest stored value in the macrocells from `low` to `high`. The field is continuous: it takes every
// value between them.
vec2 range_between(ivec3 low, ivec3 high) {
    vec2 range = macrocell_range(low);
    for (int z = low.z; z <= high.z; ++z) {
        for (int y = low.y; y <= high.y; ++y) {
            for (int x = low.x; x <= high.x; ++x) {
                vec2 part = macrocell_range(ivec3(x, y, z));
                range = vec2(min(range.x, part.x), max(range.y, part.y));
            }
        }
    }
    return range;
}

// The same in a block.
vec2 range_of(ivec3 block) {
    int side = int(scene.block_size) / MACROCELL;
    ivec3 low = side * block;
    return range_between(low, min(low + side, ivec3(scene.macrocells)) - 1);
}
