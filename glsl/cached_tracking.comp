// The picture at rest in the `caching` variant, where it is not marched (camera_march.comp): paths from the
// camera that end where they may read the cache.

#version 460
#include "scene.glsl"
#include "volume.glsl"
#include "medium.glsl"
#include "ray.glsl"
#include "ranges.glsl"
#include "random.glsl"
#include "phase.glsl"
#include "tracking.glsl"
#include "surface.glsl"
#include "brdf.glsl"
#include "light.glsl"
#include "nodes.glsl"
#include "cache.glsl"
#include "scattered.glsl"
#include "camera.glsl"
#include "path.glsl"
#include "cached_flight.glsl"
#include "camera_path.glsl"

vec3 albedo_at(Path path) {
    return albedo_of(path.value);
}
