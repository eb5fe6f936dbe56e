// Smallest and largest value of the voxels that the trilinear cells of each macrocell interpolate.

#version 460
#include "scene.glsl"
#include "volume.glsl"

layout(local_size_x = 4, local_size_y = 4, local_size_z = 4) in;
layout(binding = 4, rg32f) writeonly uniform image3D ranges;

void main() {
    ivec3 macrocell = ivec3(gl_GlobalInvocationID);
    if (any(greaterThanEqual(macrocell, ivec3(scene.macrocells)))) {
        return;
    }
    // Cells m·B … m·B + B − 1 have the voxels m·B − 1 … m·B + B − 1 as corners.
    ivec3 low = max(macrocell * MACROCELL - 1, ivec3(0));
    ivec3 high = min(macrocell * MACROCELL + MACROCELL - 1, ivec3(scene.dims) - 1);
    vec2 range = vec2(3.4e38, -3.4e38);
    for (int z = low.z; z <= high.z; ++z) {
        for (int y = low.y; y <= high.y; ++y) {
            for (int x = low.x; x <= high.x; ++x) {
                float texel = texelFetch(volume, ivec3(x, y, z), 0).r;
                range = vec2(min(range.x, texel), max(range.y, texel));
            }
        }
    }
    vec2 stored = vec2(stored_value(range.x), stored_value(range.y));
    imageStore(ranges, macrocell, vec4(stored, 0.0, 0.0));
}
