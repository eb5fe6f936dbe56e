// The largest extinction that the transfer function takes over each cell's range of values: exact for
// non-monotone ones, since a piecewise-linear function has its maximum at a point or at an end of the
// range.

#version 460
#include "scene.glsl"
#include "transfer.glsl"
#include "ranges.glsl"

layout(local_size_x = 4, local_size_y = 4, local_size_z = 4) in;
layout(binding = 5, r32f) writeonly uniform image3D majorants;

void main() {
    ivec3 cell = ivec3(gl_GlobalInvocationID);
    if (any(greaterThanEqual(cell, ivec3(scene.majorant_cells)))) {
        return;
    }
    vec2 range = range_of(cell);
    // Interpolation rounds: it may leave the voxels' range by some of their last digits.
    float rounding = 1e-6 * max(abs(range.x), abs(range.y));
    range += vec2(-rounding, rounding);
    float opacity = max(transfer_opacity(range.x), transfer_opacity(range.y));
    for (int i = 0; i < size_in_texels(transfer).x; ++i) {
        vec4 point = transfer_values(i);
        if (point.x >= range.x && point.x <= range.y) {
            opacity = max(opacity, point.z);
        }
    }
    imageStore(majorants, cell, vec4(scene.density * opacity));
}
