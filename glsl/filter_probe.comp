// The error of the device's filter against linear interpolation, at pseudo-random positions between two texels of a
// checkerboard along one of the axes: 1 where the sum of the coordinates is odd, 0 elsewhere.

#version 460
#extension GL_EXT_scalar_block_layout : require
#include "shared.glsl"

layout(local_size_x = 64) in;
uniform sampler3D checkerboard;
layout(scalar) writeonly buffer ErrorBlock { float at[]; } errors;

void main() {
    uint id = gl_GlobalInvocationID.x;
    if (id >= PROBE_POSITIONS) {
        return;
    }
    float exact = float((id + 1u) * 2654435761u >> 8u) * exp2(-24.0);
    vec3 t = vec3(0.0);
    t[id % 3u] = exact;
    float filtered = textureLod(checkerboard, (t + 0.5) / 2.0, 0.0).r;
    errors.at[id] = abs(filtered - exact);
}
