// At first a brick is filled on a coarse lattice: only nodes whose indices are even get paths, an eighth of all
// nodes. The others get light that is interpolated between these (spread_light.comp). Once the brick's nodes have
// gathered enough (gathering.glsl), all of them get paths.
//
// A ray reads few of the nodes around it: noise of nodes that have a few paths each hardly averages out along it. On
// the coarse lattice, the same number of paths makes a ray see half as many nodes, which have had eight times as many
// (`transport caching::gathering` prints the noise of both). The errors of the coarse lattice are forgotten as the
// nodes get paths of their own.
//
// A surface that stops light may lie between nodes: light is interpolated among those on the same side of it. Where the
// coarse lattice would be so coarse that noise is the smaller error, all bricks begin with the fine one
// (src/render/layout/cache.rs).

bool is_coarse_node(ivec3 node) {
    return all(equal(node & 1, ivec3(0)));
}
