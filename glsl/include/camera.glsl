// Rays from the camera, without the empty space before and behind what they can meet.

#include "scene.glsl"
#include "camera_ray.glsl"
#include "patches.glsl"
#include "ray.glsl"

LOADED_AS(r32ui) uniform utexels2D patches;

// Nearest and farthest distance at which a ray through the picture at p can meet anything; `far` is 0 if there is
// nothing.
vec2 reach_at(vec2 p) {
    ivec2 at = clamp(ivec2(p / vec2(scene.size) * float(PATCHES)), 0, PATCHES - 1) * ivec2(2, 1);
    const ivec2 next = ivec2(1, 0);
    uint near = max(texel_at(patches, at).r, texel_at(patches, WHOLE_PICTURE).r);
    uint far = max(texel_at(patches, at + next).r, texel_at(patches, WHOLE_PICTURE + next).r);
    return far == 0u ? vec2(0.0) : vec2(uintBitsToFloat(~near), uintBitsToFloat(far));
}

// A ray through the picture at p, between the nearest and the farthest place where it may meet something.
Ray camera_ray(vec2 p, out float entry, out float t_end) {
    return camera_ray_within(p, reach_at(p), entry, t_end);
}
