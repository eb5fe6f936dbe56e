// The published baseline's picture (Šmajdek et al. 2023): one ray through each pixel's centre.
//
// Its depth on the first isosurface is found by their Algorithm 1: the smallest of ever smaller random depths at
// which V ≥ value. It errs towards the back, and misses shells thinner than its gaps. Random numbers are the same in
// every picture, so that more iterations continue fewer.
//
// The medium in front is composited in fixed steps from the cache, which a trilinear filter reads. The surface is
// opaque, lit by the first sun alone (by a headlight without one), and nothing shadows it.

#version 460
#include "scene.glsl"
#include "brdf.glsl"
#include "camera_ray.glsl"
#include "light.glsl"
#include "medium.glsl"
#include "phase.glsl"
#include "push.glsl"
#include "random.glsl"
#include "ray.glsl"
#include "surface.glsl"
#include "volume.glsl"

layout(local_size_x = 8, local_size_y = 8) in;
layout(rgba32f) writeonly uniform image2D mean;
uniform sampler3D radiance_cells;

const float VOXELS_PER_STEP = 0.5;

// The depth that Algorithm 1 finds, as a share of the ray's path through the box; 1 where it finds nothing.
float iso_depth(Ray ray, float t_end, uint pixel) {
    Random random = Random(pixel, 0u, 0u);
    float depth = 1.0;
    for (uint i = 0u; i < push.depth_iterations; ++i) {
        float candidate = depth * random_numbers(random).x;
        float value = volume_value(ray.origin + candidate * t_end * ray.step);
        depth = value >= isovalue(0u) ? candidate : depth;
    }
    return depth;
}

vec3 shade(Ray ray, float t) {
    Hit hit = hit_at(ray, Crossing(t, 0, 0u));
    vec3 towards_light = -ray.direction;
    vec3 irradiance = vec3(PI);
    if (sun_count > 0u) {
        towards_light = -sun_at(0u).direction;
        irradiance = sun_at(0u).irradiance;
    }
    vec3 f = brdf_value(make_material(0u), hit.shading_normal, -ray.direction, towards_light);
    return f * max(0.0, dot(hit.shading_normal, towards_light)) * irradiance;
}

void main() {
    ivec2 pixel = own_pixel(scene.size.y);
    if (any(greaterThanEqual(pixel, ivec2(scene.size)))) {
        return;
    }
    float entry, t_end;
    Ray ray = camera_ray_within(vec2(pixel) + 0.5, vec2(0.0, LARGEST), entry, t_end);
    float depth = 1.0;
    if (surface_count > 0u && t_end > 0.0) {
        depth = iso_depth(ray, t_end, index_of_texel(pixel));
    }
    vec3 radiance = vec3(0.0);
    float transmittance = 1.0;
    float longest = VOXELS_PER_STEP / length(ray.step);
    float t_stop = has_medium ? depth * t_end : 0.0;
    for (float t = 0.0; t < t_stop && transmittance > OPAQUE_BELOW; t += longest) {
        float size = min(longest, t_stop - t);
        vec3 g = ray.origin + (t + 0.5 * size) * ray.step;
        Medium medium = medium_at(g);
        vec3 light = textureLod(radiance_cells, (g - 0.5) / vec3(scene.dims), 0.0).rgb;
        float weight = transmittance * (1.0 - exp(-medium.sigma_t * size));
        radiance += weight * medium.albedo * light;
        transmittance -= weight;
    }
    if (depth < 1.0) {
        radiance += transmittance * shade(ray, depth * t_end);
        transmittance = 0.0;
    }
    radiance += transmittance * background(ray.direction);
    imageStore(mean, pixel, vec4(radiance, 1.0 - transmittance));
}
