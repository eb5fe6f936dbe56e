// One kind of work alone, so that its rate is the most that the device can do: trilinear samples or single reads of a
// volume, or writes of a picture. Neighbouring threads work on neighbouring voxels, as neighbouring rays do, and each
// step goes to another part of the volume, so that the volume's size alone decides whether caches hold it.

#version 460
#extension GL_EXT_scalar_block_layout : require
#include "shared.glsl"
#include "texels.glsl"

layout(local_size_x = 64) in;
#include "push.glsl"

#ifdef WRITES
layout(rgba32f) writeonly uniform image2D picture;
#else
LOADED_AS(r8) uniform texels3D volume;
layout(scalar) writeonly buffer SumBlock { float at[]; } sums;
#endif

#ifdef SAMPLES
float value(vec3 at, ivec3 size) {
    vec3 from_low = at - 0.5;
    ivec3 low = max(ivec3(floor(from_low)), ivec3(0));
    ivec3 high = min(low + 1, size - 1);
    vec3 t = clamp(from_low - vec3(low), 0.0, 1.0);
    vec4 near = vec4(
        texel_at(volume, low).r, texel_at(volume, ivec3(high.x, low.yz)).r,
        texel_at(volume, ivec3(low.x, high.y, low.z)).r, texel_at(volume, ivec3(high.xy, low.z)).r);
    vec4 far = vec4(
        texel_at(volume, ivec3(low.xy, high.z)).r, texel_at(volume, ivec3(high.x, low.y, high.z)).r,
        texel_at(volume, ivec3(low.x, high.yz)).r, texel_at(volume, high).r);
    vec4 plane = mix(near, far, t.z);
    vec2 line = mix(plane.xy, plane.zw, t.y);
    return mix(line.x, line.y, t.x);
}
#endif

#ifdef READS
float value(vec3 at, ivec3 size) {
    return texel_at(volume, min(ivec3(at), size - 1)).r;
}
#endif

void main() {
    uint id = gl_GlobalInvocationID.x;
#ifdef WRITES
    ivec2 size = imageSize(picture); // a power of two
    ivec2 at = ivec2(id % uint(size.x), id / uint(size.x) % uint(size.y));
    for (uint step = 0u; step < push.steps; step++) {
        at.y = (at.y + 8) & (size.y - 1);
        imageStore(picture, at, vec4(float(step)));
    }
#else
    ivec3 size = size_in_texels(volume);
    // The fractional parts of the multiples of these three numbers fill the unit cube evenly.
    const vec3 STRIDE = vec3(0.8191725, 0.6710436, 0.5497005);
    vec3 block = fract(float(gl_WorkGroupID.x) * STRIDE.zxy);
    vec3 within = vec3(uvec3(id, id / 4u, id / 16u) % 4u) + 0.25;
    float sum = 0.0;
    for (uint step = 0u; step < push.steps; step++) {
        block = fract(block + STRIDE);
        sum += value(min(block * vec3(size) + within, vec3(size) - 0.25), size);
    }
    sums.at[id] = sum;
#endif
}
