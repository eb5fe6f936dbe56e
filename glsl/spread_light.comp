// Interpolates the light of the coarse lattice (coarse.glsl) for the nodes between, along one axis after the other:
// in the middle between the inner two of four values, a cubic through them is (−a + 9b + 9c − d)/16. (Light is curved
// where a medium is dense, and a straight line would lose some of it: `transport caching::agreement`.) A workgroup a
// brick, a thread for each of the nodes that get their light: half of all along the last axis.
//
// Nodes on another side of a surface are not used, nor those with a thin wall in between, or with several surfaces, which
// count as the same side. If that leaves neither neighbour, the node gets the mean of other nodes nearby; if none of those
// can be used either, it gets a guess.

#version 460
#include "scene.glsl"
#include "bricks.glsl"
#include "cache.glsl"
#include "flux_out.glsl"
#include "nodes.glsl"
#include "pages.glsl"
#include "push.glsl"

layout(local_size_x = BRICK, local_size_y = BRICK, local_size_z = BRICK / 2) in;
layout(CACHE_FORMAT) writeonly uniform image3D light_out;

struct Light {
    vec4 light;
    mat3 flux;
    bool known;
};

// Whether a node may hold the light of an older scene: in the first batch of its brick, nodes of the second half
// (gathering.glsl) are filled only after this pass.
bool may_be_old(ivec3 node) {
    bool is_in_second_half = ((node.x + node.y + node.z) & 1) != 0;
    return is_in_second_half && bricks.at[place_of(node / BRICK)].filled == FILLED_FIRST;
}

// Whether a row of cubes leads from one node to another of which no surface cuts any. Along an axis along which they do not
// differ, it may lie on either side of them.
bool is_open(ivec3 from, ivec3 to) {
    bvec3 stays = equal(from, to);
    bool any_open = false;
    for (uint sides = 0u; sides < 8u && !any_open; ++sides) {
        uvec3 before = uvec3(sides, sides >> 1u, sides >> 2u) & 1u;
        bool is_way = all(lessThanEqual(before, uvec3(stays)));
        ivec3 first = clamp(min(from, to) - ivec3(before), ivec3(0), last_cube());
        ivec3 last = mix(min(max(from, to) - 1, last_cube()), first, stays);
        bool open = is_way;
        for (int z = first.z; z <= last.z && open; ++z) {
            for (int y = first.y; y <= last.y && open; ++y) {
                for (int x = first.x; x <= last.x && open; ++x) {
                    ivec3 cube = ivec3(x, y, z);
                    open = has_memory(cube) && !is_cut(Cube(cube, vec3(0.0)));
                }
            }
        }
        any_open = open;
    }
    return any_open;
}

// The light of another node for a node on this side of the surfaces. `known` is false, and the light 0, where there is no node
// with memory on this side, or the way to it may lead through a surface, or it holds a guess.
Light light_of(ivec3 node, ivec3 from, uint side) {
    const Light NONE = Light(vec4(0.0), mat3(0.0), false);
    if (!is_in_lattice(node) || !has_memory(node) || !is_on_side(node, side) || may_be_old(node)
        || full_light && !is_open(from, node)) {
        return NONE;
    }
    ivec3 texel = node_texel(node);
    Light r = Light(vec4(0.0), mat3(0.0), true);
    r.light = light_at(texel, r.known);
    if (has_node_flux) {
        r.flux = flux_at(texel);
    }
    if (!r.known) {
        return NONE;
    }
    return r;
}

// The mean of the nodes nearby that have their light before this axis has its turn: those whose index is even along this
// axis and along the axes still to come.
Light mean_nearby(ivec3 node, uint side) {
    Light sum = Light(vec4(0.0), mat3(0.0), false);
    ivec3 step = mix(ivec3(1), ivec3(2), greaterThan(uvec3(0u, 1u, 2u), uvec3(push.axis)));
    float count = 0.0;
    for (int k = 0; k < 27; ++k) {
        ivec3 offset = ivec3(k % 3, k / 3 % 3, k / 9) - 1;
        if (offset[push.axis] != 0) {
            Light light = light_of(node + step * offset, node, side);
            count += float(light.known);
            sum.light += light.light;
            sum.flux += light.flux;
        }
    }
    sum.known = count > 0.0;
    sum.light /= max(count, 1.0);
    sum.flux /= max(count, 1.0);
    return sum;
}

void main() {
    uint place = gl_WorkGroupID.y * push.row + gl_WorkGroupID.x;
    if (place >= push.bricks) {
        return;
    }
    Brick brick = bricks.at[place];
    // The index is odd along the axis, any along those before it, and even along those to come.
    ivec3 e = along(push.axis);
    bvec3 is_done = lessThan(uvec3(0u, 1u, 2u), uvec3(push.axis));
    ivec3 i = ivec3(gl_LocalInvocationID);
    ivec3 node = BRICK * unpacked(brick.position) + mix(2 * i + e, i, is_done);
    bool exists = all(lessThan(i, mix(ivec3(BRICK / 2), ivec3(BRICK), is_done))) && is_in_lattice(node);
    if (brick.filled != FILLED_COARSE || !exists) {
        return;
    }
    // Where no surface stops light, there is no buffer of sides to read.
    uint side = full_light ? side_of_node(node) : 0u;
    Light a = light_of(node - 3 * e, node, side);
    Light b = light_of(node - e, node, side);
    Light c = light_of(node + e, node, side);
    Light d = light_of(node + 3 * e, node, side);
    ivec3 texel = node_texel(node);
    // Where no surface stops light, b is of the same brick, and known.
    if (full_light && !b.known && !c.known) {
        b = mean_nearby(node, side);
        if (!b.known) {
            vec4 other = texel_at(cache_light, node_texel(node - e));
            imageStore(light_out, texel, rounded(as_guess(other)));
            if (has_node_flux) {
                store_flux(texel, mat3(0.0));
            }
            return;
        }
    }
    float inner = b.known && c.known ? 0.5 : 1.0;
    float outer = 0.0;
    if (a.known && b.known && c.known && d.known) {
        inner = 9.0 / 16.0;
        outer = -1.0 / 16.0;
    }
    vec4 light = inner * (b.light + c.light) + outer * (a.light + d.light);
    imageStore(light_out, texel, rounded(max(light, 0.0)));
    if (has_node_flux) {
        store_flux(texel, inner * (b.flux + c.flux) + outer * (a.flux + d.flux));
    }
}
