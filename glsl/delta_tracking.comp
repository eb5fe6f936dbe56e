// Unbiased volumetric path tracing from the camera (the `non-caching` variant): free flights end at
// collisions, and nothing but the sky and absorption ends a path.

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
#include "camera.glsl"
#include "path.glsl"
#include "uncached.glsl"
#include "camera_path.glsl"
