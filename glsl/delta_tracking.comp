// Unbiased volumetric path tracing from the camera (the `non-caching` variant).
//
// Each slot takes a pixel from a queue, traces all of its samples one after another, and takes the
// next pixel, so that no lane idles because its neighbour's paths are longer. A slot does a
// bounded amount of work in a dispatch and keeps its path in memory until the next one. A pixel's samples
// are summed by one slot in a fixed order: the picture does not depend on the number of slots.

#version 460
#include "scene.glsl"
#include "volume.glsl"
#include "transfer.glsl"
#include "ray.glsl"
#include "ranges.glsl"
#include "random.glsl"
#include "phase.glsl"
#include "tracking.glsl"
#include "surface.glsl"
#include "brdf.glsl"
#include "light.glsl"
#include "camera.glsl"

layout(local_size_x = 64) in;
layout(push_constant, scalar) uniform PushBlock { TrackPush push; };
layout(binding = 10, scalar) buffer PathBlock { Path at[]; } paths;
layout(binding = 11, scalar) buffer CounterBlock { Counters count; } counters;
layout(binding = 12, rgba32f) writeonly uniform image2D unit_sum;

Random random_of(Path path) {
    return Random(path.pixel, path.sample_index, path.dimension);
}

// A surface on which the path starts, or −1: surfaces exist beyond the camera's segment only in
// `full` light.
int starting_surface(Path path) {
    return full_light ? path.surface : -1;
}

// Follows `ray` through its surfaces: each reflects with its opacity. Leaves path.t_end at the first
// that does, or at the end.
void find_surface(inout Path path, Ray ray, int known, bool fresh, inout Random random) {
    Crossing crossing = Crossing(path.t, known, path.inside);
    bool through = surface_count > 0u;
    while (through) {
        find_crossing(ray, path.t_end, known, fresh, crossing);
        through = crossing.surface >= 0
               && random_numbers(random).x >= surfaces.at[max(crossing.surface, 0)].opacity;
        if (through) {
            known = crossing.surface;
            fresh = false;
            crossing.inside ^= 1u << crossing.surface;
        }
    }
    path.surface = crossing.surface;
    path.inside = crossing.inside;
    path.t_end = crossing.surface >= 0 ? crossing.t : path.t_end;
}

// Product of 1 − opacity over the crossings of `ray` in [0, t_end].
float surface_transmittance(Ray ray, float t_end, int known, uint inside) {
    Crossing crossing = Crossing(0.0, -1, inside);
    float transmittance = 1.0;
    bool fresh = true;
    bool through = true;
    while (through) {
        find_crossing(ray, t_end, known, fresh, crossing);
        through = crossing.surface >= 0;
        if (through) {
            transmittance *= 1.0 - surfaces.at[crossing.surface].opacity;
            known = crossing.surface;
            fresh = false;
            crossing.inside ^= 1u << crossing.surface;
            through = transmittance > 0.0;
        }
    }
    return transmittance;
}

bool begin_pixel(inout Path path) {
    uint pixel = atomicAdd(counters.count.next_pixel, 1u);
    if (pixel >= scene.size.x * scene.size.y) {
        return false;
    }
    path.pixel = pixel;
    path.samples_left = push.samples;
    path.sample_index = push.first_sample - 1u;
    path.sum = vec4(0.0);
    return true;
}

void begin_sample(inout Path path) {
    --path.samples_left;
    ++path.sample_index;
    path.dimension = 0u;
    path.phase = PHASE_FLIGHT;
    path.bounces = 0u;
    path.throughput = vec3(1.0);
    path.pdf = ALONE;
    path.inside = 0u;
    Random random = random_of(path);
    vec2 jitter = random_numbers(random).xy;
    vec2 corner = vec2(path.pixel % scene.size.x, path.pixel / scene.size.x);
    float entry;
    Ray ray = camera_ray(corner + jitter, entry, path.t_end);
    path.origin = ray.origin;
    path.direction = ray.direction;
    path.t = 0.0;
    path.surface = -1;
    if (surface_count > 0u && path.t_end > 0.0) {
        find_surface(path, ray, -1, true, random);
    }
    path.dimension = random.dimension;
}

// The path leaves the box.
void escape(inout Path path) {
    bool unscattered = path.bounces == 0u;
    vec3 radiance = escaping_radiance(path.direction, path.pdf);
    if (unscattered && background_is_color) {
        radiance = scene.background;
    }
    if (!unscattered || !background_is_transparent) {
        path.sum.rgb += path.throughput * radiance;
    }
    path.sum.a += unscattered ? 0.0 : 1.0;
}

// The path turns into `direction` at path.origin; `known` is the surface it starts on, or −1.
void turn(inout Path path, vec3 direction, int known, inout Random random) {
    path.direction = direction;
    Ray ray = make_ray(path.origin, direction);
    path.t = 0.0;
    path.t_end = clip_ray(ray, 0.0).y;
    path.surface = -1;
    if (full_light) {
        find_surface(path, ray, known, true, random);
    }
}

// Next-event estimation: sends a shadow ray that will bring `radiance`.
void aim_shadow_ray(inout Path path, LightSample light, vec3 radiance, int known) {
    if (max(radiance.x, max(radiance.y, radiance.z)) <= 0.0) {
        return;
    }
    Ray ray = make_ray(path.origin, light.direction);
    path.shadow_direction = light.direction;
    path.shadow_t = 0.0;
    path.shadow_t_end = clip_ray(ray, 0.0).y;
    path.shadow_radiance = radiance;
    if (full_light) {
        path.shadow_radiance *= surface_transmittance(ray, path.shadow_t_end, known, path.inside);
    }
    path.phase = PHASE_SHADOW;
}

void scatter_in_medium(inout Path path, float value, inout Random random) {
    path.throughput *= transfer_color(value);
    path.origin += path.t * path.direction / scene.spacing;
    if (has_light_sampling) {
        LightSample light = sample_light(random_words(random));
        float density = phase_density(dot(path.direction, light.direction));
        vec3 radiance = path.throughput * density * light_weight(light, density) * light.radiance;
        aim_shadow_ray(path, light, radiance, -1);
    }
    vec4 u = random_numbers(random);
    float cosine = phase_sample_cosine(u.x);
    vec3 direction = direction_around(path.direction, cosine, u.y);
    path.pdf = phase_density(cosine);
    turn(path, direction, -1, random);
}

// Returns false if the path ends here.
bool reflect_at_surface(inout Path path, inout Random random) {
    Ray ray = make_ray(path.origin, path.direction);
    int s = path.surface;
    Hit hit = hit_at(ray, Crossing(path.t_end, s, path.inside));
    Material material = make_material(uint(s));
    vec3 v = -path.direction;
    path.origin += path.t_end * ray.step;
    if (has_light_sampling) {
        LightSample light = sample_light(random_words(random));
        vec3 l = light.direction;
        if (dot(hit.geometric, l) > 0.0) {
            float density = brdf_density(material, hit.shading, v, l);
            vec3 f = brdf_value(material, hit.shading, v, l) * max(0.0, dot(hit.shading, l));
            vec3 radiance = path.throughput * f * light_weight(light, density) * light.radiance;
            aim_shadow_ray(path, light, radiance, s);
        }
    }
    vec4 u = random_numbers(random);
    vec3 l = brdf_sample(material, hit.shading, v, u.xyz);
    float cosine = dot(hit.shading, l);
    if (cosine <= 0.0 || dot(hit.geometric, l) <= 0.0) {
        return false;
    }
    path.pdf = brdf_density(material, hit.shading, v, l);
    if (path.pdf <= 0.0) {
        return false; // the lobe's edge, lost to rounding
    }
    path.throughput *= brdf_value(material, hit.shading, v, l) * cosine / path.pdf;
    turn(path, l, s, random);
    return true;
}

// Whether the path goes on after an event, with Russian roulette where nothing else ends it.
bool survives(inout Path path, inout Random random) {
    float brightest = max(path.throughput.x, max(path.throughput.y, path.throughput.z));
    if (scene.max_bounces > 0u) {
        return brightest > 0.0;
    }
    const float ROULETTE_BELOW = 0.2;
    if (brightest < ROULETTE_BELOW) {
        if (random_numbers(random).x * ROULETTE_BELOW >= brightest) {
            return false;
        }
        path.throughput *= ROULETTE_BELOW / brightest;
    }
    return true;
}

// A path that ends while its shadow ray is on its way: the flight that follows meets nothing.
void end_path(inout Path path) {
    path.throughput = vec3(0.0);
    path.t = 0.0;
    path.t_end = -1.0;
    path.surface = -1;
}

void scatter(inout Path path, float value, bool at_surface, inout Random random) {
    if (scene.max_bounces > 0u && path.bounces >= scene.max_bounces) {
        end_path(path);
        return;
    }
    ++path.bounces;
    bool alive = true;
    if (at_surface) {
        alive = reflect_at_surface(path, random);
    } else {
        scatter_in_medium(path, value, random);
    }
    if (!alive || !survives(path, random)) {
        end_path(path);
    }
}

// Takes the path to its next event and handles it.
void advance(inout Path path) {
    Random random = random_of(path);
    float value = 0.0;
    uint outcome = OUTCOME_END;
    Ray ray = make_ray(path.origin, path.direction);
    if (has_medium && path.phase == PHASE_FLIGHT) {
        outcome = track_collision(ray, path.t, path.t_end, random, value);
    }
    if (path.phase == PHASE_FLIGHT && outcome != OUTCOME_PENDING) {
        bool at_surface = outcome == OUTCOME_END && path.surface >= 0;
        if (outcome == OUTCOME_COLLISION || at_surface) {
            scatter(path, value, at_surface, random);
        } else {
            escape(path);
            path.phase = PHASE_IDLE;
        }
    }
    if (has_light_sampling && path.phase == PHASE_SHADOW) {
        Ray shadow = make_ray(path.origin, path.shadow_direction);
        float transmittance = 1.0;
        outcome = OUTCOME_END;
        if (has_medium) {
            outcome = track_transmittance(shadow, path.shadow_t, path.shadow_t_end, random,
                                          transmittance);
        }
        path.shadow_radiance *= transmittance;
        if (outcome == OUTCOME_END) {
            path.sum.rgb += path.shadow_radiance;
            path.phase = PHASE_FLIGHT;
        }
    }
    path.dimension = random.dimension;
}

void main() {
    uint slot = gl_GlobalInvocationID.x;
    if (slot >= push.slots) {
        return;
    }
    Path path = paths.at[slot];
    bool working = true;
    while (working && work < push.work) {
        ++work;
        if (path.phase == PHASE_IDLE) {
            working = path.samples_left > 0u || begin_pixel(path);
            if (working) {
                begin_sample(path);
            }
        }
        if (working) {
            advance(path);
            if (path.phase == PHASE_IDLE && path.samples_left == 0u) {
                ivec2 at = ivec2(path.pixel % scene.size.x, path.pixel / scene.size.x);
                imageStore(unit_sum, at, path.sum);
            }
        }
    }
    paths.at[slot] = path;
    if (working) {
        atomicAdd(counters.count.unfinished, 1u);
    }
    atomicAdd(counters.count.lookups, lookups);
}
