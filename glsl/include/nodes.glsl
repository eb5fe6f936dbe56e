// The lattice of the cache: equal cells that fill the box, a node at the centre of each. Between nodes, light is
// interpolated; from the outer ones to the box's faces it is extrapolated. The *cube* of a node is the space between
// it and the next nodes, out to the faces at the border. Bricks are BRICK³ nodes.

#include "scene.glsl"

bool is_in_lattice(ivec3 node) {
    return all(lessThan(uvec3(node), scene.cache_nodes)); // as `uint`, a negative index is a large one
}

// The last cube along each axis; the node behind it has none of its own.
ivec3 last_cube() {
    return max(ivec3(scene.cache_nodes) - 2, 0);
}

vec3 node_position(ivec3 node) {
    return 0.5 + (vec3(node) + 0.5) * scene.cache_step;
}

// The lowest node of the cube that holds a point, and the point's position in that cube: in [0, 1], or beyond near
// the box's faces.
struct Cube {
    ivec3 low;
    vec3 p;
};

Cube cube_at(vec3 g) {
    vec3 c = (g - 0.5) / scene.cache_step - 0.5;
    Cube cube;
    cube.low = clamp(ivec3(floor(c)), ivec3(0), last_cube());
    // Where an axis has a single node, that node stands for the whole axis.
    cube.p = mix(c - vec3(cube.low), vec3(0.0), equal(scene.cache_nodes, uvec3(1u)));
    return cube;
}
