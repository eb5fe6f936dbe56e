// Which of the cache's cubes are at the rim of a dense medium: where a face of the box or a clip plane ends it, or where
// it ends within the volume from one voxel to the next.
//
// Light falls steeply behind such an end, as the exponential integral E₂ of the optical depth does where it comes from
// a sky. Between a node in the vacuum and one in the medium a straight line misses that, and beyond the outermost nodes
// it loses even more (`transport caching::rim`). So paths go on in these cubes as if there were no cache; where one is
// dense throughout, in those next to it as well, since bricks begin with cubes twice as wide (coarse.glsl), and where it
// ends within the volume, in those around (`mark_reach`).
//
// Most cubes are judged by their macrocells, without any voxels, so that an edit of the transfer function shows soon,
// and few bricks are read of a volume that streams.

#version 460
#include "scene.glsl"
#include "medium.glsl"
#include "ray.glsl"
#include "volume.glsl"
const uint WORDS_A_BRICK = RIM_WORDS;
#include "cube_bits.glsl"

// Axes along which the box stands for an infinite slab: it is some 100 times as wide as thick, so that light through its
// side faces hardly matters, unless these are looked at, and has at most three nodes, so that every cube touches a side face.
bvec3 endless_axes() {
    const uint FEW = 3u;
    const float WIDE = 99.0; // times as wide as the slab is thick
    vec3 extent = scene.half_extent;
    float thickness = min(extent.x, min(extent.y, extent.z));
    bvec3 is_wide = greaterThanEqual(extent, vec3(WIDE * thickness));
    bvec3 has_few = lessThanEqual(scene.cache_nodes, uvec3(FEW));
    return bvec3(uvec3(is_wide) & uvec3(has_few));
}

// The longest side of a cube across which a face of the box or a clip plane ends what is in a span; 0 if none does.
float side_at_end(Span span) {
    vec3 sides = scene.cache_step * scene.spacing;
    vec3 at_faces = mix(mix(mix(vec3(0.0), sides, span.begins), sides, span.ends), vec3(0.0), endless_axes());
    float side = max(at_faces.x, max(at_faces.y, at_faces.z));
    for (uint c = 0u; c < clip_count; ++c) {
        vec3 normal = clips.at[c].normal;
        vec3 farthest = mix(span.low, span.high, greaterThan(normal, vec3(0.0)));
        bool meets = dot(normal, to_world(farthest)) > clips.at[c].offset;
        side = max(side, meets ? dot(abs(normal), sides) : 0.0);
    }
    return side;
}

float longest_side() { // of a voxel
    return max(scene.spacing.x, max(scene.spacing.y, scene.spacing.z));
}

// The least difference of extinction between two neighbouring voxels at which the medium counts as ending there.
float least_jump() {
    return JUMP_DEPTH / longest_side();
}

// The least second difference of extinction, in a row of three voxels, at which it does so: a cloud's smooth extinction may
// rise as steeply as at an edge, but it does not begin to do so all at once.
float least_bend() {
    return BEND_DEPTH / longest_side();
}

// Whether extinction differs by more than `least_jump` on the way from one of the voxels to a neighbour, between whose values a
// narrow tent of the transfer function may lie, or bends by more than `least_bend` at one of them. Not at the outer ones, since the
// voxels beyond may lie in other bricks of the volume; of the two that an edge lies between, one is no outer one at scales below 1.
bool has_jump(Voxels voxels) {
    float most = least_jump();
    float most_bent = least_bend();
    for (uint axis = 0u; axis < 3u; ++axis) {
        uvec3 axes = (axis + uvec3(0u, 1u, 2u)) % 3u;
        ivec3 voxel = voxels.low;
        for (voxel[axes.z] = voxels.low[axes.z]; voxel[axes.z] <= voxels.high[axes.z]; ++voxel[axes.z]) {
            for (voxel[axes.y] = voxels.low[axes.y]; voxel[axes.y] <= voxels.high[axes.y]; ++voxel[axes.y]) {
                voxel[axes.x] = voxels.low[axes.x];
                float last = volume_voxel(voxel);
                vec2 lasts = vec2(sigma_t_of(last));
                for (++voxel[axes.x]; voxel[axes.x] <= voxels.high[axes.x]; ++voxel[axes.x]) {
                    float value = volume_voxel(voxel);
                    vec2 sigma_t = sigma_t_between(min(last, value), max(last, value));
                    // What is farthest from the last voxel's, at this one or on the way to it.
                    float here = lasts.y - sigma_t.x > sigma_t.y - lasts.y ? sigma_t.x : sigma_t.y;
                    bool has_three = voxel[axes.x] > voxels.low[axes.x] + 1;
                    bool bends = has_three && abs(lasts.x - 2.0 * lasts.y + here) > most_bent;
                    if (bends || sigma_t.y - sigma_t.x > most) {
                        return true;
                    }
                    last = value;
                    lasts = vec2(lasts.y, here);
                }
            }
        }
    }
    return false;
}

// Whether neighbours with extinctions in this range may differ so much. (Within less than that, they bend by up to twice as much
// at a film's voxel: such films stay with the cache.)
bool may_jump(vec2 sigma_t) {
    return sigma_t.y - sigma_t.x > min(least_jump(), least_bend());
}

bool may_mark(Span span) {
    vec2 sigma_t = sigma_t_range(range_of_macrocells(span));
    return sigma_t.y * side_at_end(span) > RIM_DEPTH || may_jump(sigma_t);
}

uint marks_of(ivec3 cube) {
    Span span = span_of(cube, cube);
    vec2 sigma_t = sigma_t_range(range_of_macrocells(span));
    vec2 depth = sigma_t * side_at_end(span);
    uint at_end = depth.x > RIM_DEPTH ? NEIGHBOURS_MARKED : depth.y > RIM_DEPTH ? CUBE_MARKED : NOTHING_MARKED;
    if (!may_jump(sigma_t)) {
        return at_end;
    }
    // Voxels beyond the first ones of the next cube belong to that cube as well, and are tested there.
    Voxels voxels = voxels_of(cube);
    voxels.high = mix(voxels_of(cube + 1).low, voxels.high, span.ends);
    bool jumps = may_jump(sigma_t_range(range_of_voxels(voxels))) && has_jump(voxels);
    return jumps ? SURROUNDINGS_MARKED : at_end;
}

void examine(ivec3 node, bool is_possible) {}
void store_examined(ivec3 node) {}
