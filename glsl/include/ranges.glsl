// Ranges of macrocells: boxes of MACROCELL³ trilinear cells.

// Smallest and largest stored value that the field takes in the cell.
layout(binding = 4 LOADED_AS(rg32f)) uniform texels3D ranges;

vec2 macrocell_range(ivec3 macrocell) {
    return texel_at(ranges, macrocell).rg;
}
