// The largest extinction in each block (parts/medium.rs says how large blocks are).

#version 460
#include "scene.glsl"
#include "volume.glsl"
#include "medium.glsl"
#include "ranges.glsl"

layout(local_size_x = 4, local_size_y = 4, local_size_z = 4) in;
layout(r32f) writeonly uniform image3D majorants;

void main() {
    ivec3 cell = ivec3(gl_GlobalInvocationID);
    if (any(greaterThanEqual(cell, ivec3(scene.majorant_cells)))) {
        return;
    }
    imageStore(majorants, cell, vec4(largest_sigma_t(range_of(cell))));
}
