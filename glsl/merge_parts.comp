// Adds up the parts of each node's paths, and merges their mean with the light that the node had before.
//
// A batch is as large as all batches of a node before, as a rule, so that half of every merge is new: rounding to 16
// bits then adds up to less than one unit in the last place, after any number of updates.
//
// A workgroup for each turn, a thread for each of its nodes; those of a brick's first part do the work.

#version 460
#include "scene.glsl"
#include "cache.glsl"
#include "coarse.glsl"
#include "flux_out.glsl"
#include "nodes.glsl"
#include "pages.glsl"
#include "push.glsl"
#include "turns.glsl"

layout(local_size_x = NODES) in;
layout(CACHE_FORMAT) writeonly uniform image3D light_out;

void main() {
    uint index = gl_WorkGroupID.x;
    uint nodes = nodes_of(index);
    if (gl_LocalInvocationID.x >= nodes || turns.at[index].part != 0u) {
        return;
    }
    Turn turn = turns.at[index];
    ivec3 node = node_at(index, turn.place, gl_LocalInvocationID.x);
    if (!is_in_lattice(node)) {
        return;
    }
    uint item = first_item_of(index) + gl_LocalInvocationID.x;
    NodeSums sums = NodeSums(vec4(0.0), mat3(0.0));
    for (uint part = 0u; part < turn.parts; ++part) {
        add_sums(item + part * nodes, sums);
    }
    ivec3 texel = node_texel(node);
    float paths = float(turn.paths);
    float share = paths / (turn.history + paths);
    vec4 light = sums.light / paths;
    if (share < 1.0) {
        vec4 before = texel_at(cache_light, texel);
        share = before.a < 0.0 ? 1.0 : share; // a guess
        light = mix(before, light, share);
    }
    imageStore(light_out, texel, rounded(light));
    mat3 flux = sums.flux / paths;
    if (has_node_flux) {
        if (share < 1.0) {
            flux = (1.0 - share) * flux_at(texel) + share * flux;
        }
        store_flux(texel, flux);
    }
    if (has_surface_fluxes && is_coarse_node(node)) {
        TwoFluxes fluxes = TwoFluxes(vec4(flux[0], 0.0), vec4(flux[1], flux[2].x));
        if (share < 1.0) {
            fluxes = (1.0 - share) * two_fluxes_at(texel) + share * fluxes;
        }
        store_two_fluxes(texel, fluxes);
    }
}
