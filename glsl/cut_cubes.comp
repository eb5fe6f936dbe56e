// Which of the cache's cubes a surface cuts: those over which the field takes values on both sides of it.

#version 460
#include "scene.glsl"
#include "volume.glsl"
#include "ray.glsl"
#include "ranges.glsl"
#include "surface.glsl"
#include "cells.glsl"
#include "cube_bits.glsl"

// Whether values lie on both sides of a surface.
bool is_cut(vec2 range) {
    for (uint s = 0u; s < surface_count; ++s) {
        float value = surfaces.at[s].value;
        if (range.x < value && range.y >= value) {
            return true;
        }
    }
    return false;
}

bool may_mark(Span span) {
    return is_cut(range_of_macrocells(span));
}

uint marks_of(ivec3 cube) {
    return is_cut(range_of_voxels(voxels_of(cube))) ? CUBE_MARKED : NOTHING_MARKED;
}

void note(uint brick) {
    bricks.at[brick].is_cut = 1u;
}
