// Unbiased volumetric path tracing from the camera (the `non-caching` variant): free flights end at collisions, and a path
// goes on until it leaves the volume, roulette ends it, or it has had as many bounces as the scene allows.

#version 460
#include "scene.glsl"
#include "camera_path.glsl"
#include "random.glsl"

bool end_in_cache(inout Path path, inout Random random) {
    return false;
}
