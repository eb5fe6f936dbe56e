// The picture at rest in the `caching` variant, where it is not marched (camera_march.comp): paths from the
// camera that end where they may read the cache.

#version 460
#include "scene.glsl"
#include "cached_flight.glsl"
#include "camera_path.glsl"
