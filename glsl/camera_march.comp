// The picture at rest in the `caching` variant, where the medium's scattering is nearly isotropic (`is_marched` in
// src/render/features.rs): one ray through a random point of each pixel collects the light that the cache holds all
// along its way, and so has next to no noise.
//
// The errors of that light are corrected at points of the ray picked in proportion to what they contributed: the
// error of interpolation at one point, and at four points the light of the suns, which becomes exact: a shadow ray
// replaces the suns' light that was read from the cache there. (A single point would cause most of a sample's noise.)
//
// On surfaces, the light of the suns is marched to as well (sunlit.glsl), unless the ray crosses very many of them. The
// cache does not know the rest of the light there, nor that in cubes whose nodes do not tell it (`is_left_to_paths`): the
// march leaves both to paths (tail_tracking.comp). Of all such points on a ray one is picked, in proportion to the weight
// of its light in the pixel, and stands for the others.

#version 460
#include "scene.glsl"
#include "brdf.glsl"
#include "bundle.glsl"
#include "cache.glsl"
#include "camera.glsl"
#include "camera_ray.glsl"
#include "light.glsl"
#include "loop.glsl"
#include "march.glsl"
#include "marched.glsl"
#include "nodes.glsl"
#include "phase.glsl"
#include "push.glsl"
#include "random.glsl"
#include "ray.glsl"
#include "scattered.glsl"
#include "sunlit.glsl"
#include "surface.glsl"
#include "taken.glsl"
#include "tails.glsl"
#include "tracking.glsl"
#include "volume_bricks.glsl"

layout(local_size_x = 8, local_size_y = 8) in;
layout(rgba32f) writeonly uniform image2D unit_sum;
layout(scalar) writeonly buffer TailBlock { Tail at[]; } tails;

// Below this transmittance, a ray goes on with it or ends, at random: the mean is the same, and a bright light far behind
// is not lost.
const float ROULETTE_BELOW = 1e-4;
// A smaller share of a sun's light counts as none: it would change only a float's last digits.
const float LEAST_SUNLIGHT = 1e-7;

// Radiance and transmittance of a ray, front to back, up to where the march is.
struct Front {
    vec3 radiance;
    float transmittance;
    float taken; // weight of all light taken from the cache
    vec4 picked_t; // four points, each picked in proportion to the light taken there
    vec4 picked_suns; // and the mean transmittance towards the suns that was read there
    mat4x3 picked_albedo; // and the albedo
    Tail tail;
};

const Front NOTHING_MET = Front(vec3(0.0), 1.0, 0.0, vec4(0.0), vec4(0.0), mat4x3(0.0),
                                Tail(0.0, 0.0, NOTHING, uvec2(0u)));

// Leaves a tail to paths. Of all tails of the ray one is kept, with a probability in proportion to its weight, and gets the
// weight of all: weighted reservoir sampling with one place (Chao, A General Purpose Unequal Probability Sampling Plan, 1982).
void leave_to_paths(inout Front front, Tail tail, inout Random random) {
    float sum = front.tail.weight + tail.weight;
    if (random_numbers(random).x * sum < tail.weight) {
        front.tail = tail;
    }
    front.tail.weight = sum;
}

const vec4 QUARTERS = vec4(0.0, 0.25, 0.5, 0.75);

// Which of four reservoirs take a point of this weight, if `sum` is the weight of all points up to and including it: each
// does with probability weight/sum. Their random numbers are stratified.
bvec4 reservoirs_that_take(float weight, float sum, float u) {
    return lessThan(fract(u + QUARTERS) * sum, vec4(weight));
}

bool is_opaque(Front front) {
    return front.transmittance <= 0.0;
}

// Points picked among the steps since the last read of the cache: one for a tail, and those of the front's four that are
// replaced if the light that is read counts.
struct Picked {
    bvec4 is_new;
    vec4 t;
    mat4x3 albedo;
    float tail_t;
    vec3 tail_albedo;
};

Picked nothing_picked(Front front) {
    return Picked(bvec4(false), front.picked_t, front.picked_albedo, 0.0, scene.color);
}

// Picks points of a step, given three random numbers. Its weight is in `taken` already; `taken_before` is that of all earlier
// reads.
void pick(inout Picked picked, MarchStep s, float weight, float taken_before, Taken taken, vec3 u) {
    bvec4 here = reservoirs_that_take(weight, taken_before + taken.weight, u.x);
    // Sampled points and not the steps' midpoints, since the suns' transmittance may fall steeply within a step.
    vec4 points = sample_collisions(s, fract(u.z + QUARTERS));
    picked.t = mix(picked.t, points, here);
    picked.is_new = mix(picked.is_new, here, here);
    if (!has_one_color) {
        for (uint k = 0u; k < 4u; ++k) {
            picked.albedo[k] = mix(picked.albedo[k], s.albedo, bvec3(here[k]));
        }
    }
    if (has_tails) {
        bool is_tail = u.y * taken.weight < weight;
        picked.tail_t = is_tail ? points.x : picked.tail_t;
        // The step's mean albedo: the transfer function's colour at the picked point may belong to opacity 0.
        picked.tail_albedo = is_tail ? s.albedo : picked.tail_albedo;
    }
}

// Makes steps until the cache has to be read, or the stretch or the ray ends.
void march_to_read(Ray ray, inout March march, inout Front front, inout Taken taken, inout Picked picked,
                   inout Random random) {
    LOOP {
        vec3 u = random_numbers(random).xyz;
        MarchStep s = make_step(ray, march);
        float weight = front.transmittance * s.alpha;
        front.transmittance -= weight;
        take(taken, weight, s.albedo, mean_collision(s));
        pick(picked, s, weight, front.taken, taken, u);
        if (front.transmittance < ROULETTE_BELOW) {
            bool is_left = random_numbers(random).x * ROULETTE_BELOW < front.transmittance;
            front.transmittance = is_left ? ROULETTE_BELOW : 0.0;
        }
        if (is_opaque(front) || !march.goes_on || is_due(taken)) {
            break;
        }
    }
}

// Collects the light of these steps from the cache, or leaves it to paths. `suns_here` is what the suns' light would bring
// without anything in its way.
void read_light(Ray ray, Taken taken, Picked picked, vec3 suns_here, inout Front front, inout Random random) {
    Cube cube = cube_taken(taken, ray);
    CachedLight light = read_cache(cube);
    // Which nodes are in sight is measured with few rays; another ray may pass beside a surface that stops these,
    // and read a node that was not in sight, whose light is a guess.
    if (is_left_to_paths(cube) || has_tails && !light.known) {
        Tail tail = Tail(picked.tail_t, taken.weight, COLLISION, packed_albedo(picked.tail_albedo));
        leave_to_paths(front, tail, random);
    } else {
        front.radiance += albedo_taken(taken) * (scattered_back(light, ray) + light.suns * suns_here);
        front.taken += taken.weight;
        front.picked_t = picked.t;
        front.picked_albedo = picked.albedo;
        front.picked_suns = mix(front.picked_suns, vec4(light.suns), picked.is_new);
    }
}

// Marches through the medium between t and t_end, where no surface is in the way.
void march_segment(Ray ray, float t, float t_end, inout Front front, inout Random random) {
    if (!(t < t_end)) {
        return;
    }
    March march = begin_march(ray, t, t_end);
    vec3 suns_here = suns_scattered(-ray.direction);
    if (!march.goes_on) {
        return;
    }
    // Loops over stretches, and over reads of the cache in each.
    LOOP {
        LOOP {
            Taken taken = NOTHING_TAKEN;
            Picked picked = nothing_picked(front);
            march_to_read(ray, march, front, taken, picked, random);
            read_light(ray, taken, picked, suns_here, front, random);
            if (is_opaque(front) || !march.goes_on) {
                break;
            }
        }
        if (is_opaque(front)) {
            break;
        }
        next_stretch(ray, march);
        if (!march.goes_on) {
            break;
        }
    }
}

// The light of a sun that is scattered at `g` towards the ray's beginning.
vec3 sunlight(Ray ray, vec3 g, inout Random random) {
    LightSample sun = sample_sun(random_numbers(random).x);
    Ray shadow = make_ray(g, sun.towards);
    vec2 span = clip_ray(shadow, 0.0);
    Tracking tracking = begin_tracking(shadow, track_from(shadow, span.x, span.y));
    float transmittance = 1.0;
    float value;
    LOOP {
        if (tracking.outcome == OUTCOME_PENDING) {
            step_tracking(tracking, true, random, value, transmittance);
        }
        if (tracking.outcome != OUTCOME_PENDING) {
            break;
        }
    }
    if (full_light) {
        transmittance *= surface_transmittance(shadow, span.x, span.y, NOTHING, 0u);
    }
    return transmittance * phase_function(ray.direction, sun.towards) * sun.radiance;
}

// The difference between the suns' light at the picked points and the part that was read from the cache.
vec3 sun_correction(Ray ray, Front front, inout Random random) {
    vec3 suns_here = suns_scattered(-ray.direction);
    vec3 missed = vec3(0.0);
    for (uint k = 0u; k < 4u; ++k) {
        vec3 g = ray.origin + front.picked_t.x * ray.step;
        vec3 taken = front.picked_suns.x * suns_here;
        vec3 albedo = has_one_color ? scene.color : front.picked_albedo[0];
        missed += 0.25 * albedo * (sunlight(ray, g, random) - taken);
        // Not indexed by k: compilers keep indexed variables in memory.
        front.picked_t = front.picked_t.yzwx;
        front.picked_suns = front.picked_suns.yzwx;
        front.picked_albedo = mat4x3(front.picked_albedo[1], front.picked_albedo[2], front.picked_albedo[3],
                                     front.picked_albedo[0]);
    }
    return missed;
}

// The correction of the light that was read from the cache.
vec3 cache_correction(Ray ray, Front front, inout Random random) {
    vec3 g = ray.origin + front.picked_t.x * ray.step;
    vec3 albedo = has_one_color ? scene.color : front.picked_albedo[0];
    vec3 missed = albedo * interpolation_correction(cube_at(g)) * scene.cache_unit;
    if (sun_count > 0u) {
        missed += sun_correction(ray, front, random);
    }
    return front.taken * missed;
}

// Marches along the ray through everything that it meets.
void march(Ray ray, float t_end, inout Front front, inout Random random) {
    Search search = begin_search(ray, 0.0, NOTHING, 0u);
    float t = 0.0;
    LOOP {
        Crossing crossing = NO_CROSSING;
        if (surface_count > 0u) {
            crossing = find_crossing(ray, t_end, search);
        }
        bool hits = crossing.surface >= 0;
        march_segment(ray, t, hits ? crossing.t : t_end, front, random);
        if (!hits || is_opaque(front)) {
            break;
        }
        float weight = front.transmittance * surface_at(uint(crossing.surface)).opacity;
        bool leaves_suns = !has_time_for_suns();
        if (weight > 0.0 && sun_count > 0u && !leaves_suns) {
            Hit hit = hit_at(ray, crossing);
            Material material = make_material(uint(crossing.surface));
            front.radiance += weight * sunlight_reflected(ray, crossing, hit, material, LEAST_SUNLIGHT);
        }
        leave_to_paths(front, Tail(crossing.t, weight, crossing.surface, uvec2(crossing.inside, leaves_suns)), random);
        front.transmittance -= weight;
        if (is_opaque(front)) {
            break;
        }
        t = crossing.t;
        pass_through(ray, crossing, search);
    }
}

void main() {
    ivec2 texel = own_pixel(scene.size.y);
    uint position = index_of_texel(texel);
    uint item = first_item() + position;
    if (any(greaterThanEqual(texel, ivec2(scene.size))) || position >= items_at_once() || item >= item_count()) {
        return;
    }
    if (!begins_pixel(position)) {
        return;
    }
    uint index = pixel_at(item / units_together());
    ivec2 pixel = is_in_bricks ? texel_at_index(index) : texel;
    Random random = Random(index, push.sample_index + item % units_together(), 0u);
    float entry, t_end;
    Ray ray = camera_ray(vec2(pixel) + marched_point(random), entry, t_end);
    Front front = NOTHING_MET;
    march(ray, t_end, front, random);
    if (front.taken > 0.0) {
        front.radiance += cache_correction(ray, front, random);
    }
    front.radiance += front.transmittance * background(ray.direction);
    if (!ends_pixel(position)) {
        return;
    }
    count_lookups();
    imageStore(unit_sum, texel, vec4(front.radiance, 1.0 - front.transmittance));
    if (has_tails) {
        tails.at[position] = front.tail;
    }
}
