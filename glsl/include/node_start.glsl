// Where the paths of a node begin: at the node, or, where the medium is a film, in the film.
//
// A tent of the transfer function makes films of medium that may be thinner than the space between nodes, and light varies
// across them. Nodes beside a film or deep in it do not tell the light that it scatters on average. So paths begin at random
// places around the node, in proportion to extinction times the weight that the node has there in an interpolation. If these
// weights wᵢ of all nodes add up to 1 everywhere and Lᵢ = ∫ wᵢ σt L / ∫ wᵢ σt is what the nodes hold, then what is read from
// the cache has the right mean over all collisions, however coarse the lattice is:
//
//     ∫ σt Σᵢ wᵢ Lᵢ = Σᵢ ∫ wᵢ σt L = ∫ σt L.
//
// That is a mean over the medium, of which a camera sees all alike only where it is thin. In dense parts it sees the lit side,
// and there, as in a smooth medium, light at the node and its curvature tell more.

#include "scene.glsl"
#include "cache.glsl"
#include "loop.glsl"
#include "medium.glsl"
#include "nodes.glsl"
#include "pages.glsl"
#include "random.glsl"
#include "ray.glsl"
#include "tracking.glsl"

// Whether none of the cubes around a node is cut by a surface, or without memory.
bool is_free_of_surfaces(ivec3 node) {
    for (int k = 0; k < 8; ++k) {
        ivec3 cube = clamp(node - ivec3(k & 1, k >> 1 & 1, k >> 2), ivec3(0), last_cube());
        if (!has_memory(cube) || is_cut(Cube(cube, vec3(0.0)))) {
            return false;
        }
    }
    return true;
}

// How far from a node its paths may begin, along each axis, in steps of the lattice: as far as the node counts in an
// interpolation. Where surfaces stop light, a path must begin on the node's side of them.
float reach_of(ivec3 node, bool is_coarse) {
    if (!has_tents || full_light && !is_free_of_surfaces(node)) {
        return 0.0;
    }
    return is_coarse && !full_light ? 2.0 : 1.0;
}

// Extinction at a point; 0 outside of the box and behind clip planes. No voxel is read where all around is empty, since bricks of a
// volume that streams would be loaded for it.
float sigma_t_within(vec3 g) {
    vec2 span = clip_ray(Ray(g, vec3(0.0), vec3(0.0)), 0.0);
    ivec3 block = clamp(ivec3(g / scene.block_size), ivec3(0), ivec3(scene.blocks) - 1);
    return span.x < span.y && majorant_of(block) > 0.0 ? sigma_t_of(lookup_at(g)) : 0.0;
}

// Where paths begin that may begin within `reach` of a node. Of eight points, one in each octant around the node and distributed
// as its weight, one is picked in proportion to extinction (Talbot, Cline and Egbert, "Importance Resampling for Global
// Illumination", 2005).
vec3 start_around(vec3 node, float reach, inout Random random) {
    const float MOST_DEPTH = 0.5; // of the medium around that still counts as thin
    const uint POINTS = 8u;
    vec3 sides = reach * scene.cache_step;
    vec3 start = node;
    float sum = 0.0;
    uint k = 0u;
    // Lavapipe would execute a branch around this for every path, and executes one turn of a loop.
    LOOP {
        if (k == POINTS || reach == 0.0) {
            break;
        }
        vec4 u = random_numbers(random);
        vec3 octant = vec3(uvec3(k, k >> 1u, k >> 2u) & 1u) * 2.0 - 1.0;
        vec3 point = node + octant * sides * (1.0 - sqrt(u.xyz));
        float sigma_t = sigma_t_within(point);
        sum += sigma_t;
        start = u.w * sum < sigma_t ? point : start;
        ++k;
    }
    vec3 across = 2.0 * sides * scene.spacing;
    float depth = sum / float(POINTS) * max(across.x, max(across.y, across.z));
    return depth < MOST_DEPTH ? start : node;
}
