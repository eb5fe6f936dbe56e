// Gathering: paths from nodes that have had few paths end at their first collision, with the light that the cache
// holds there. Batches are then steps of a Gauss–Seidel iteration of the transport equation; a few of them spread
// light as far as long paths would, in less time.
//
// The light of a gathered path has the errors of the cache between nodes. So nodes gather only at first, and trace
// their paths to the end from then on: gathered light weighs less and less.
//
// A batch in which nodes gather fills one half of the nodes after the other, like the two colours of a chessboard, and a
// half reads only the other: no value depends on which node was faster.

#include "scene.glsl"
#include "cache.glsl"
#include "loop.glsl"
#include "nodes.glsl"
#include "pages.glsl"

// Whether the paths of a batch gather.
bool gathers(Turn turn, uint nodes_half) {
    bool has_light = turn.paths_before > 0u || nodes_half == 1u;
    return has_light && turn.gathers != 0u;
}

// Of a cube's eight corners, the four whose sum of indices is even (`nodes_half` 0) or odd (1), no two of which share an
// edge: the linear function through the light at these. A loop, for drivers that take long to compile reads of images.
CachedLight read_half(Cube cube, int nodes_half) {
    int mirrored = cube.low.x + cube.low.y + cube.low.z + nodes_half & 1;
    CachedLight r = CachedLight(vec3(0.0), 0.0, mat3(0.0), true);
    int k = 0;
    LOOP {
        ivec3 corner = ivec3((k ^ k >> 1 ^ mirrored) & 1, k & 1, k >> 1);
        float weight = 0.25 + 0.5 * dot(2.0 * vec3(corner) - 1.0, cube.p - 0.5);
        ivec3 texel = node_texel(cube.low + corner);
        vec4 light = weight * light_at(texel, r.known);
        r.mean += light.rgb;
        r.suns += light.a;
        if (is_anisotropic) {
            r.flux += weight * flux_at(texel);
        }
        ++k;
        if (k == 4) {
            break;
        }
    }
    r.mean = max(r.mean, 0.0);
    r.suns = max(r.suns, 0.0);
    return r;
}
