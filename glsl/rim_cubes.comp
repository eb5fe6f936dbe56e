// Which of the cache's cubes are at the rim: where a face of the box or a clip plane ends a dense medium in them. One
// bit a cube, one thread a brick.
//
// Light falls steeply behind such an end, as the exponential integral E₂ of the optical depth does where it comes from
// a sky. Between a node in the vacuum and one in the medium a straight line misses that, and beyond the outermost nodes
// it loses even more (`transport caching::rim`). So paths go on in these cubes as if there were no cache.
//
// The medium is judged by its macrocells, without any voxels: an edit of the transfer function shows at once, and a
// volume that streams need not be read.

#version 460
#include "scene.glsl"
#include "volume.glsl"
#include "medium.glsl"
#include "ray.glsl"
#include "ranges.glsl"
#include "cells.glsl"

layout(local_size_x = 64) in;
#include "push.glsl"
layout(scalar) writeonly buffer RimBlock { uint at[]; } rims;
layout(scalar) readonly buffer BrickBlock { Brick at[]; } bricks;
layout(scalar) buffer CounterBlock { Counters count; } counters;

// The cubes from `first` to `last`, in grid space: from node to node, or out to the box's faces.
struct Span {
    vec3 low, high;
    bool meets_face;
};

Span span_of(ivec3 first, ivec3 last) {
    bvec3 begins = equal(first, ivec3(0));
    bvec3 ends = greaterThanEqual(last + 2, ivec3(scene.cache_nodes));
    return Span(mix(node_position(first), vec3(0.5), begins),
                mix(node_position(last + 1), vec3(scene.dims) + 0.5, ends),
                any(begins) || any(ends));
}

// Whether a face of the box or a clip plane ends what is in a span.
bool meets_end(Span span) {
    bool meets = span.meets_face;
    for (uint c = 0u; c < clip_count; ++c) {
        vec3 normal = clips.at[c].normal;
        vec3 farthest = mix(span.low, span.high, greaterThan(normal, vec3(0.0)));
        meets = meets || dot(normal, to_world(farthest)) > clips.at[c].offset;
    }
    return meets;
}

// Smallest and largest stored value in the macrocells that a span meets.
vec2 range_in(Span span) {
    ivec3 last = ivec3(scene.macrocells) - 1;
    ivec3 low = min(ivec3(span.low) / MACROCELL, last);
    ivec3 high = min(ivec3(span.high) / MACROCELL, last);
    vec2 range = vec2(3.4e38, -3.4e38);
    for (int z = low.z; z <= high.z; ++z) {
        for (int y = low.y; y <= high.y; ++y) {
            for (int x = low.x; x <= high.x; ++x) {
                vec2 part = macrocell_range(ivec3(x, y, z));
                range = vec2(min(range.x, part.x), max(range.y, part.y));
            }
        }
    }
    return range;
}

bool is_rim(Span span) {
    vec3 sides = scene.cache_step * scene.spacing;
    return meets_end(span) && largest_sigma_t(range_in(span)) * max(sides.x, max(sides.y, sides.z)) > RIM_DEPTH;
}

void main() {
    uint brick = gl_GlobalInvocationID.x;
    if (brick >= push.bricks) {
        return;
    }
    ivec3 first = BRICK * unpacked(bricks.at[brick].position);
    uint words[2] = uint[2](0u, 0u);
    if (meets_end(span_of(first, first + BRICK - 1))) {
        for (int inner = 0; inner < BRICK * BRICK * BRICK; ++inner) {
            ivec3 cube = first + ivec3(inner % BRICK, inner / BRICK % BRICK, inner / (BRICK * BRICK));
            words[inner / 32] |= (is_rim(span_of(cube, cube)) ? 1u : 0u) << inner % 32;
        }
    }
    rims.at[2u * brick] = words[0];
    rims.at[2u * brick + 1u] = words[1];
    uint count = uint(bitCount(words[0]) + bitCount(words[1]));
    if (count > 0u) {
        atomicAdd(counters.count.rim_cubes, count);
    }
}
