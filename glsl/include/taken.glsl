// What a march sums up between two reads of the cache. Light varies little from step to step, so several steps share a
// read, at the mean position of the light that they collect.

#include "scene.glsl"
#include "cache.glsl"
#include "nodes.glsl"
#include "ray.glsl"

// Sums over a march's steps since it last read the cache.
struct Taken {
    vec3 albedo;  // Σ weight·albedo, if it has several colours
    float weight; // Σ T·(1 − exp(−σt·Δ))
    float t;      // Σ weight·t
    uint steps;
};

const Taken NOTHING_TAKEN = Taken(vec3(0.0), 0.0, 0.0, 0u);

// Whether it is time to read the cache: after one and a half times as many steps as there are voxels between nodes. (A
// ray leaves three cells, on average, where it passes two voxels.) The number is the same for all rays, however little
// light they collect: threads that run together then read together.
bool is_due(Taken taken) {
    return 2u * taken.steps >= 3u * scene.cache_stride;
}

void take(inout Taken taken, float weight, vec3 albedo, float t) {
    ++taken.steps;
    if (!has_one_color) {
        taken.albedo += weight * albedo;
    }
    taken.weight += weight;
    taken.t += weight * t;
}

vec3 albedo_taken(Taken taken) {
    return has_one_color ? taken.weight * scene.color : taken.albedo;
}

// The mean position of the light in `taken`.
Cube cube_taken(Taken taken, Ray ray) {
    float t = taken.t / max(taken.weight, 1e-30);
    return cube_at(ray.origin + t * ray.step);
}
