// Paths that end at a collision by reading the cache. Where the nodes around a cube do not tell the light in it
// (cache.glsl), or hold a guess since they are out of sight, a path scatters as if there were no cache.

#include "scene.glsl"
#include "cache.glsl"
#include "nodes.glsl"
#include "path.glsl"
#include "random.glsl"
#include "scattered.glsl"

// Ends a path at a collision, with a shadow ray for the suns.
bool end_in_cache(inout Path path, inout Random random) {
    vec3 g = end_of_flight(path);
    Cube cube = cube_at(g);
    if (path.collisions + 1u < first_cached_collision || is_left_to_paths(cube)) {
        return false;
    }
    CachedLight light = read_cache(cube);
    if (!light.known) {
        return false;
    }
    // One axis, at random, stands for all three.
    uint axis = min(uint(3.0 * random_numbers(random).x), 2u);
    vec3 missed = 3.0 * curvature_correction(axis, cube) * scene.cache_unit;
    contribute(path, path.throughput * (scattered_light(light, -path.direction) + missed));
    path.origin = g;
    if (sun_count > 0u) {
        aim_at_sun(path, random);
    }
    end_path(path);
    return true;
}
