// Ranges of macrocells: boxes of MACROCELL³ trilinear cells.

// Smallest and largest stored value that the field takes in the cell.
layout(binding = 4) uniform sampler3D ranges;

vec2 macrocell_range(ivec3 macrocell) {
    return texelFetch(ranges, macrocell, 0).rg;
}
