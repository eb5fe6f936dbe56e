// The picture at rest in the `caching` variant where nothing but a medium is seen, whose scattering has next to
// no direction (`is_marched` in src/render/shared.rs): one ray through a random place of each pixel takes the
// light that the cache holds all along its way, and so has next to no noise. (With surfaces their noise is what
// is seen, and a march costs several collisions; see cached_tracking.comp.)
//
// What is wrong with that light is corrected at places picked in proportion to what they contributed: what
// interpolation misses at one, and at four the suns, whose part is made exact: by a shadow ray against what was
// taken of them there. (A single one would be most of a sample's noise.)

#version 460
#include "scene.glsl"
#include "volume.glsl"
#include "medium.glsl"
#include "ray.glsl"
#include "random.glsl"
#include "phase.glsl"
#include "tracking.glsl"
#include "light.glsl"
#include "cells.glsl"
#include "cache.glsl"
#include "camera.glsl"
#include "march.glsl"

layout(local_size_x = 8, local_size_y = 8) in;
layout(push_constant, scalar) uniform PushBlock { CameraMarchPush push; };
layout(rgba32f) writeonly uniform image2D unit_sum;

// Below this nothing behind is seen: a float's last digits.
const float OPAQUE_BELOW = 1e-6;

// A step of the march.
struct MarchStep {
    float absorbed; // 1 − exp(−optical depth)
    vec3 albedo;    // of what it meets, and where, on average
    float t;
    float picked_t; // one place, in proportion to what is met there
};

// By two independent samples: with optical depths a and b, exp(−(a + b)/2) is too large by half the
// variance of their mean (Jensen), of which (a − b)²/4 is an estimate.
MarchStep sample_step(Ray ray, float t, float size, vec3 u) {
    vec2 places = t + size * u.xy;
    vec2 values = vec2(lookup(ray, places.x), lookup(ray, places.y));
    Medium first = medium_of(values.x);
    Medium second = medium_of(values.y);
    vec2 depths = size * vec2(first.sigma_t, second.sigma_t);
    float mean = 0.5 * (depths.x + depths.y);
    float variance = 0.25 * (depths.x - depths.y) * (depths.x - depths.y);
    vec2 shares = mean > 0.0 ? 0.5 * depths / mean : vec2(0.5);
    MarchStep s;
    s.absorbed = absorbed_by(mean) + 0.5 * variance * (1.0 - absorbed_by(mean));
    s.albedo = shares.x * first.albedo + shares.y * second.albedo;
    s.t = dot(shares, places);
    s.picked_t = u.z < shares.x ? places.x : places.y;
    return s;
}

// What a ray has met so far.
struct Front {
    vec3 radiance;
    float transmittance;
    vec4 picked_t; // four places, each picked in proportion to the light taken there
    vec4 picked_suns; // and the suns' share that was taken there
};

const Front NOTHING_MET = Front(vec3(0.0), 1.0, vec4(0.0), vec4(0.0));

// Which of the four move to a place of this weight, of `sum` so far; they are spread as evenly as can be.
bvec4 picks(float weight, float sum, float u) {
    return lessThan(fract(u + vec4(0.0, 0.25, 0.5, 0.75)) * sum, vec4(weight));
}

Front march_segment(Ray ray, float t_end, inout Random random) {
    Front front = NOTHING_MET;
    March march = begin_march(ray, 0.0, t_end);
    vec3 suns_here = suns_scattered(-ray.direction);
    if (march.steps == 0u) {
        return front;
    }
    bool is_opaque;
    // Stretch by stretch, look by look at the cache, step by step.
    LOOP {
        LOOP {
            Taken taken = NOTHING_TAKEN;
            bvec4 is_picked = bvec4(false);
            LOOP {
                vec4 u = random_numbers(random);
                MarchStep s = sample_step(ray, march.t, march.size, u.xyz);
                make_step(march);
                float weight = front.transmittance * s.absorbed;
                front.transmittance -= weight;
                take(taken, weight, s.albedo, s.t);
                bvec4 here = picks(weight, 1.0 - front.transmittance, u.w);
                front.picked_t = mix(front.picked_t, vec4(s.picked_t), here);
                is_picked = mix(is_picked, here, here);
                is_opaque = front.transmittance < OPAQUE_BELOW;
                if (is_opaque || march.steps == 0u || is_due(taken)) {
                    break;
                }
            }
            CachedLight light = read_cache(cube_taken(taken, ray));
            front.radiance += albedo_taken(taken) * (scattered_back(light, ray) + light.suns * suns_here);
            front.picked_suns = mix(front.picked_suns, vec4(light.suns), is_picked);
            if (is_opaque || march.steps == 0u) {
                break;
            }
        }
        if (is_opaque) {
            break;
        }
        next_stretch(ray, march);
        if (march.steps == 0u) {
            break;
        }
    }
    front.transmittance = is_opaque ? 0.0 : front.transmittance;
    return front;
}

// What a sun brings to `g`.
vec3 sunlight(Ray ray, vec3 g, inout Random random) {
    LightSample sun = sample_sun(random_numbers(random).x);
    Ray shadow = make_ray(g, sun.direction);
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
    return transmittance * phase_density(dot(ray.direction, sun.direction)) * sun.radiance;
}

// What the suns bring to the picked places beyond what was taken.
vec3 missed_suns(Ray ray, Front front, inout Random random) {
    vec3 suns_here = suns_scattered(-ray.direction);
    vec3 missed = vec3(0.0);
    for (uint k = 0u; k < 4u; ++k) {
        vec3 g = ray.origin + front.picked_t.x * ray.step;
        vec3 taken = front.picked_suns.x * suns_here;
        vec3 albedo = albedo_of(lookup(ray, front.picked_t.x));
        missed += 0.25 * albedo * (sunlight(ray, g, random) - taken);
        // Not indexed by k: compilers keep in memory what is.
        front.picked_t = front.picked_t.yzwx;
        front.picked_suns = front.picked_suns.yzwx;
    }
    return missed;
}

// What the light taken should have been more.
vec3 missed_light(Ray ray, Front front, inout Random random) {
    vec3 g = ray.origin + front.picked_t.x * ray.step;
    vec3 albedo = albedo_of(lookup(ray, front.picked_t.x));
    vec3 missed = albedo * missed_by_interpolation(cube_at(g)) * scene.cache_unit;
    if (sun_count > 0u) {
        missed += missed_suns(ray, front, random);
    }
    return (1.0 - front.transmittance) * missed;
}

void main() {
    ivec2 pixel = own_pixel();
    if (any(greaterThanEqual(pixel, ivec2(scene.size)))) {
        return;
    }
    Random random = Random(uint(pixel.y) * scene.size.x + uint(pixel.x), push.sample_index, 0u);
    vec2 jitter = unit_intervals(even_words(random, direction_pairs(0u))).xy;
    float entry, t_end;
    Ray ray = camera_ray(vec2(pixel) + jitter, entry, t_end);
    Front front = NOTHING_MET;
    if (t_end > 0.0) {
        front = march_segment(ray, t_end, random);
        if (front.transmittance < 1.0) {
            front.radiance += missed_light(ray, front, random);
        }
    }
    vec3 background = background_is_color ? scene.background
                                          : escaping_radiance(ray.direction, ALONE);
    if (!background_is_transparent) {
        front.radiance += front.transmittance * background;
    }
    imageStore(unit_sum, pixel, vec4(front.radiance, 1.0 - front.transmittance));
}
