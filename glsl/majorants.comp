// The largest extinction in each block (parts/medium.rs says how large blocks are).

#version 460
#include "scene.glsl"
#include "medium.glsl"
#include "ranges.glsl"

layout(local_size_x = 4, local_size_y = 4, local_size_z = 4) in;
layout(r32f) writeonly uniform image3D majorants;

void main() {
    ivec3 block = ivec3(gl_GlobalInvocationID);
    if (any(greaterThanEqual(block, ivec3(scene.blocks)))) {
        return;
    }
    imageStore(majorants, block, vec4(largest_sigma_t(range_of(block))));
}
