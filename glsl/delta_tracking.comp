// Unbiased volumetric path tracing from the camera (the `non-caching` variant): free flights end at
// collisions, and nothing but the sky and absorption ends a path.

#version 460
#include "scene.glsl"
#include "camera_path.glsl"
#include "random.glsl"

bool end_in_cache(inout Path path, inout Random random) {
    return false;
}
