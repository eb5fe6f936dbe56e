// Which of the cache's cubes a surface cuts: those over which the field takes values on both sides of it. And on which
// side of the surfaces each node is.

#version 460
#include "scene.glsl"
#include "nodes.glsl"
#include "pages.glsl"
#include "ranges.glsl"
#include "surface.glsl"
#include "volume.glsl"
const uint WORDS_A_BRICK = CUT_WORDS;
#include "cube_bits.glsl"

bool may_mark(Span span) {
    return may_cross(range_of_macrocells(span), 0u, true);
}

uint marks_of(ivec3 cube) {
    return may_cross(range_of_voxels(voxels_of(cube)), 0u, true) ? CUBE_MARKED : NOTHING_MARKED;
}

// The side on which the thread's node is.
uint side;

// Where no surface is near, the range of the macrocell says on which side the node is, without any voxel.
void examine(ivec3 node, bool is_possible) {
    vec3 g = node_position(node);
    ivec3 macrocell = min(ivec3(g) / MACROCELL, ivec3(scene.macrocells) - 1);
    side = side_of_surfaces(inside_of_range(is_possible ? vec2(volume_value(g)) : macrocell_range(macrocell)));
}

void store_examined(ivec3 node) {
    uvec2 word = side_bits_of(node);
    atomicOr(bits.at[word.x], side << word.y);
}
