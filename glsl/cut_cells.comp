// Which of the cache's cubes a surface cuts: those over which the field takes values on both sides of
// it. One bit a cube, one workgroup a brick.

#version 460
#include "scene.glsl"
#include "volume.glsl"
#include "ray.glsl"
#include "ranges.glsl"
#include "surface.glsl"
#include "cells.glsl"

layout(local_size_x = 4, local_size_y = 4, local_size_z = 4) in;
#include "push.glsl"
layout(scalar) writeonly buffer CutBlock { uint at[]; } cuts;
layout(scalar) readonly buffer BrickBlock { Brick at[]; } bricks;

shared uint words[2];
// Threads of the group that have missed a brick of the volume.
shared uint lacking;

void main() {
    uint brick = gl_WorkGroupID.y * push.row + gl_WorkGroupID.x;
    if (brick >= push.bricks || stands_back(brick) || is_done(brick)) {
        return;
    }
    ask_ahead();
    uint thread = gl_LocalInvocationIndex;
    if (thread < 2u) {
        words[thread] = 0u;
    }
    if (thread == 0u) {
        lacking = 0u;
    }
    barrier();
    ivec3 cube = BRICK * unpacked(bricks.at[brick].position) + ivec3(gl_LocalInvocationID);
    ivec3 last = ivec3(scene.dims) - 1;
    ivec3 low = ivec3(floor(node_position(cube))) - 1;
    ivec3 high = ivec3(floor(node_position(cube + 1)));
    low = clamp(low, ivec3(0), last);
    high = clamp(high, ivec3(0), last);
    low = mix(low, ivec3(0), equal(cube, ivec3(0)));
    high = mix(high, last, greaterThanEqual(cube + 2, ivec3(scene.cache_nodes)));
    vec2 range = vec2(3.4e38, -3.4e38);
    for (int z = low.z; z <= high.z; ++z) {
        for (int y = low.y; y <= high.y; ++y) {
            for (int x = low.x; x <= high.x; ++x) {
                float v = volume_voxel(ivec3(x, y, z));
                range = vec2(min(range.x, v), max(range.y, v));
            }
        }
    }
    if (is_void) {
        atomicAdd(lacking, 1u);
    }
    for (uint s = 0u; s < surface_count; ++s) {
        float value = surfaces.at[s].value;
        if (range.x < value && range.y >= value) {
            atomicOr(words[thread / 32u], 1u << thread % 32u);
        }
    }
    barrier();
    bool has_missed = lacking > 0u;
    if (thread == 0u) {
        report(brick, has_missed, !has_missed);
        if (!has_missed) {
            set_done(brick);
        }
    }
    if (thread < 2u && !has_missed) {
        cuts.at[2u * brick + thread] = words[thread];
    }
}
