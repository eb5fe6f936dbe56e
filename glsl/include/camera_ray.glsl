// Rays through the picture.

#include "scene.glsl"
#include "random.glsl"
#include "ray.glsl"

// The point of its pixel through which a sample's ray goes, from two numbers in [0, 1).
vec2 point_in_pixel(vec2 u) {
    return scene.through_centres != 0u ? vec2(0.5) : u;
}

// The point of its pixel through which a marched sample's ray goes.
vec2 marched_point(Random random) {
    return point_in_pixel(unit_intervals(sobol_words(random, direction_pairs(0u))).xy);
}

// A ray through the picture at p, in pixels from its upper left corner, between two world distances from where rays start,
// and within the box. `entry` is the eye's distance to where it begins: the ray's own t starts there, so that a distant eye
// costs it no digits. The ray as a whole is off by up to 6e-8 of the distance from where rays start. Misses have t_end < 0.
Ray camera_ray_within(vec2 p, vec2 reach, out float entry, out float t_end) {
    vec2 ndc = vec2(2.0, -2.0) * p / vec2(scene.size) + vec2(-1.0, 1.0);
    vec3 across = ndc.x * scene.right + ndc.y * scene.up;
    vec3 start = scene.start + (is_orthographic ? across : scene.start_distance * across);
    vec3 ahead = is_orthographic ? scene.forward : scene.forward + across;
    Ray ray = make_ray(to_grid(start), normalize(ahead));
    vec2 span = clip_ray(ray, reach.x);
    span.y = min(span.y, reach.y);
    entry = scene.start_distance * length(ahead) + span.x;
    t_end = span.x < span.y ? span.y - span.x : -1.0;
    ray.origin = clamp(fma(vec3(span.x), ray.step, ray.origin), vec3(0.5), vec3(scene.dims) + 0.5);
    return ray;
}

// The pixel of a thread, in groups of 8×8: in Morton order, so that threads that run together, be it 4 lanes or 32,
// see a square of the picture and not a row. Rays of a square meet more of the same cells.
//
// On a CPU, each row of groups is followed by the seventh below it, round and round a picture of `height` pixels: lavapipe
// gives each core one run of groups, and a run of neighbouring rows may hold most of what there is to see. On a GPU, groups
// that run together stay together, and read the same voxels.
ivec2 own_pixel(uint height) {
    uint i = gl_LocalInvocationIndex;
    uvec2 inner = uvec2(i & 1u | i >> 1u & 2u | i >> 2u & 4u, i >> 1u & 1u | i >> 2u & 2u | i >> 3u & 4u);
    uvec2 group = gl_WorkGroupID.xy;
#ifdef IS_SOFTWARE
    // A prime: every row is visited once. Where it divides the number of rows, each round begins a row further down.
    const uint STRIDE = 7u;
    uint rows = (height + 7u) / 8u;
    uint shift = rows % STRIDE == 0u ? group.y / (rows / STRIDE) : 0u;
    group.y = (STRIDE * group.y + shift) % rows;
#endif
    return ivec2(8u * group + inner);
}
