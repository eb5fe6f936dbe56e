// Paths from nodes that have had few: they end at their first collision, with what the cache shows there. Batches are
// then turns of a Gauss–Seidel iteration of the transport equation; a few of them spread light as far as long paths
// would, for less time and with less noise.
//
// What such a path brings is as wrong as the cache is between nodes. So nodes gather only at first, and trace their
// paths to the end from then on: what was gathered weighs less and less.
//
// A batch fills one half of the nodes after the other, like the two colours of a chessboard, and a half reads only
// the other: no value depends on which node was faster.

// What a gathered path counts for beside a new one. It shares the errors of what it read with all its neighbours;
// the sooner these are forgotten, the better. (Measured: at 1, the noise of a young cache is twice as large.)
const float WORTH = 0.25;

// Whether the paths of a batch do.
bool gathers(Brick brick, uint nodes_half) {
    bool has_neighbours = all(greaterThan(scene.cache_nodes, uvec3(1u)));
    bool has_light = brick.first_sample > 0u || nodes_half == 1u;
    return has_neighbours && has_light && brick.first_sample + brick.samples <= GATHERED;
}

// Paths that a node has had, by what they are worth.
float history(Brick brick) {
    return float(brick.first_sample) - (1.0 - WORTH) * float(min(brick.first_sample, GATHERED));
}

// The light that four of a cube's corners make a linear function of, no two of which are neighbours: those whose
// indices have a sum like `half_read`.
CachedLight read_half(Cube cube, int half_read) {
    bool is_mirrored = (cube.low.x + cube.low.y + cube.low.z + half_read & 1) != 0;
    int side = is_mirrored ? 1 : 0;
    vec3 p = cube.p;
    p.x = is_mirrored ? 1.0 - p.x : p.x;
    ivec3 a = cube.low;
    ivec3 texels[4] = ivec3[4](
        node_texel(a + ivec3(side, 0, 0)), node_texel(a + ivec3(1 - side, 1, 0)),
        node_texel(a + ivec3(1 - side, 0, 1)), node_texel(a + ivec3(side, 1, 1)));
    vec4 weights = 0.5 * vec4(2.0 - p.x - p.y - p.z, p.x + p.y - p.z, p.x - p.y + p.z, p.y + p.z - p.x);
    vec4 light = weights.x * texel_at(cache_light, texels[0])
               + weights.y * texel_at(cache_light, texels[1])
               + weights.z * texel_at(cache_light, texels[2])
               + weights.w * texel_at(cache_light, texels[3]);
    light = max(light, 0.0);
    CachedLight r = CachedLight(light.rgb, light.a, vec3(0.0));
    if (is_anisotropic) {
        r.flux = weights.x * texel_at(cache_flux, texels[0]).rgb
               + weights.y * texel_at(cache_flux, texels[1]).rgb
               + weights.z * texel_at(cache_flux, texels[2]).rgb
               + weights.w * texel_at(cache_flux, texels[3]).rgb;
    }
    return r;
}
