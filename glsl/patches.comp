// The nearest and the farthest distance at which rays through each patch of the picture can meet anything. Rays from
// the camera begin and end there (camera.glsl), and do not walk through empty space before and behind.
//
// One thread handles one block. If there is something to meet in it, the bounding box of its eight corners in the
// picture gives the patches. The bits of positive floats compare like the floats themselves, so atomic maxima find
// both distances, the nearest one through its complement; 0 means that nothing was found.

#version 460
#include "scene.glsl"
#include "patches.glsl"
#include "ranges.glsl"
#include "ray.glsl"
#include "surface.glsl"
#include "tracking.glsl"

layout(local_size_x = 4, local_size_y = 4, local_size_z = 4) in;
layout(r32ui) uniform uimage2D patches;

// The most by which a ray may miss the point that it is aimed at, as a share of the distance.
const float ROUNDING = 1e-6;

// A block as the camera sees it.
struct View {
    vec2 low, high;  // in patches, from the upper left
    float near, far; // along rays
    float least_depth, most_depth; // before the eye's plane, or the plane in which rays start
};

bool holds_something(ivec3 block) {
    return has_medium && majorant_of(block) > 0.0
        || surface_count > 0u && may_cross(range_of(block), 0u, true);
}

View view_of(vec3 from, vec3 to) {
    vec2 extent = vec2(dot(scene.right, scene.right), dot(scene.up, scene.up));
    View view = View(vec2(LARGEST), vec2(-LARGEST), length(clamp(vec3(0.0), from, to)), 0.0, LARGEST, -LARGEST);
    for (uint corner = 0u; corner < 8u; ++corner) {
        vec3 d = mix(from, to, notEqual(uvec3(corner) & uvec3(1u, 2u, 4u), uvec3(0u)));
        float depth = dot(d, scene.forward);
        vec2 ndc = vec2(dot(d, scene.right), -dot(d, scene.up)) / extent;
        ndc = is_orthographic ? ndc : ndc / (depth + scene.start_distance);
        vec2 at = (0.5 + 0.5 * ndc) * float(PATCHES);
        view.low = min(view.low, at);
        view.high = max(view.high, at);
        view.far = max(view.far, length(d));
        view.least_depth = min(view.least_depth, depth);
        view.most_depth = max(view.most_depth, depth);
    }
    if (is_orthographic || scene.start_distance > 0.0) {
        float longest = is_orthographic ? 1.0 : length(scene.forward + scene.right + scene.up);
        view.near = max(0.0, view.least_depth);
        view.far = longest * view.most_depth;
    }
    return view;
}

void note(ivec2 patch_at, View view) {
    uint near = floatBitsToUint(max(0.0, view.near - 10.0 * ROUNDING * view.far));
    uint far = floatBitsToUint((1.0 + 10.0 * ROUNDING) * view.far);
    imageAtomicMax(patches, patch_at * ivec2(2, 1), ~near);
    imageAtomicMax(patches, patch_at * ivec2(2, 1) + ivec2(1, 0), far);
}

void main() {
    ivec3 block = ivec3(gl_GlobalInvocationID);
    if (any(greaterThanEqual(block, ivec3(scene.blocks))) || !holds_something(block)) {
        return;
    }
    vec3 from = to_world(vec3(block) * scene.block_size) - scene.start;
    vec3 to = to_world(vec3(block + 1) * scene.block_size) - scene.start;
    View view = view_of(from, to);
    if (view.most_depth <= 0.0) {
        return;
    }
    float nearest = view.least_depth + scene.start_distance;
    if (!is_orthographic && nearest <= ROUNDING * view.far) {
        note(WHOLE_PICTURE, view); // the eye's plane cuts it: it has no outline
        return;
    }
    float side = 2.0 * min(length(scene.right), length(scene.up)) / float(PATCHES);
    float margin = 1e-3 + ROUNDING * view.far / (is_orthographic ? side : side * nearest);
    ivec2 first = max(ivec2(floor(clamp(view.low - margin, -1.0, float(PATCHES)))), 0);
    ivec2 last = min(ivec2(floor(clamp(view.high + margin, -1.0, float(PATCHES)))), PATCHES - 1);
    for (int y = first.y; y <= last.y; ++y) {
        for (int x = first.x; x <= last.x; ++x) {
            note(ivec2(x, y), view);
        }
    }
}
