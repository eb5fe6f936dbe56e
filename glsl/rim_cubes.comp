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
    bvec3 meets_face; // across each axis
};

Span span_of(ivec3 first, ivec3 last) {
    ivec3 nodes = ivec3(scene.cache_nodes);
    bvec3 begins = equal(first, ivec3(0));
    bvec3 ends = greaterThanEqual(last + 2, nodes);
    // Of an axis with so few nodes, the middle of the box is in a cube at a face. Such a box is a slab of a medium
    // without end, as a rule.
    bvec3 is_long = greaterThan(nodes, ivec3(3));
    return Span(mix(node_position(first), vec3(0.5), begins),
                mix(node_position(last + 1), vec3(scene.dims) + 0.5, ends),
                mix(bvec3(false), mix(begins, bvec3(true), ends), is_long));
}

// The longest side of a cube across which a face of the box or a clip plane ends what is in a span; 0 if none does.
float side_at_end(Span span) {
    vec3 sides = scene.cache_step * scene.spacing;
    vec3 at_faces = mix(vec3(0.0), sides, span.meets_face);
    float side = max(at_faces.x, max(at_faces.y, at_faces.z));
    for (uint c = 0u; c < clip_count; ++c) {
        vec3 normal = clips.at[c].normal;
        vec3 farthest = mix(span.low, span.high, greaterThan(normal, vec3(0.0)));
        bool meets = dot(normal, to_world(farthest)) > clips.at[c].offset;
        side = max(side, meets ? dot(abs(normal), sides) : 0.0);
    }
    return side;
}

vec2 range_in(Span span) {
    ivec3 last = ivec3(scene.macrocells) - 1;
    return range_between(min(ivec3(span.low) / MACROCELL, last), min(ivec3(span.high) / MACROCELL, last));
}

bool is_rim(Span span) {
    float side = side_at_end(span);
    return side > 0.0 && largest_sigma_t(range_in(span)) * side > RIM_DEPTH;
}

void main() {
    uint brick = gl_GlobalInvocationID.y * push.row + gl_GlobalInvocationID.x;
    if (brick >= push.bricks) {
        return;
    }
    ivec3 first = BRICK * unpacked(bricks.at[brick].position);
    uint words[2] = uint[2](0u, 0u);
    if (side_at_end(span_of(first, first + BRICK - 1)) > 0.0) {
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
