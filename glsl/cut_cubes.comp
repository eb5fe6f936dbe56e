// Which of the cache's cubes a surface cuts: those over which the field takes values on both sides of it.

#version 460
#include "scene.glsl"
#include "volume.glsl"
#include "ray.glsl"
#include "ranges.glsl"
#include "surface.glsl"
#include "cells.glsl"
#include "cube_bits.glsl"

bool may_mark(Span span) {
    return may_cross(range_of_macrocells(span), 0u, true);
}

uint marks_of(ivec3 cube) {
    return may_cross(range_of_voxels(voxels_of(cube)), 0u, true) ? CUBE_MARKED : NOTHING_MARKED;
}

void note(uint brick) {
    bricks.at[brick].is_cut = 1u;
}
