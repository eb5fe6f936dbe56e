// The steps of a path, wherever it began: it flies, meets surfaces, scatters, and looks for light with shadow rays.
// It advances event by event and keeps its whole state in a `Path`, so that it can wait for the next dispatch
// anywhere.
//
// A shader that includes this defines what happens to the light and the events of a path, by the functions that are declared
// below.

#include "scene.glsl"
#include "brdf.glsl"
#include "light.glsl"
#include "loop.glsl"
#include "medium.glsl"
#include "path_search.glsl"
#include "phase.glsl"
#include "random.glsl"
#include "ray.glsl"
#include "surface.glsl"
#include "tracking.glsl"
#include "volume_bricks.glsl"

// Adds `radiance` that arrives where the path began.
void contribute(inout Path path, vec3 radiance);
// The path's first segment meets medium or surface with this share of its light.
void add_coverage(inout Path path, float share);
// The path leaves the box.
void escape(inout Path path);
// At a collision: contributes all light that the path would bring and ends it there, if that light is known.
bool end_in_cache(inout Path path, inout Random random);
// Whether the suns' light at the point where the path scatters now has been found by other means.
bool has_suns_already(Path path);

// The point in grid space where the flight ends.
vec3 end_of_flight(Path path) {
    return path.origin + path.t_end * path.direction / scene.spacing;
}

Random random_of(Path path) {
    return Random(path.pixel, path.sample_index, path.dimension);
}

uvec4 words_for_light(Path path, inout Random random) {
    return path.bounces > 1u ? random_words(random) : sobol_words(random, light_pairs(path.bounces));
}

vec4 numbers_for_direction(Path path, inout Random random) {
    return path.bounces > 1u ? random_numbers(random)
                             : unit_intervals(sobol_words(random, direction_pairs(path.bounces)));
}

// A new path at path.origin, with nothing behind it.
void begin_path(inout Path path) {
    path.dimension = 0u;
    path.stage = STAGE_FLIGHT;
    path.searches = 0u;
    path.bounces = 0u;
    path.collisions = 0u;
    path.throughput = vec3(1.0);
    path.pdf = NO_MIS;
    path.inside = 0u;
    path.surface = NOTHING;
    // Any valid block: `begin_tracking` reads its majorant even if the flight is empty.
    path.block = ivec3(0);
}

// The path's flight begins on `ray`, at path.origin.
void begin_flight(inout Path path, Ray ray, float t, float t_end) {
    Track track = track_from(ray, t, t_end);
    path.direction = ray.direction;
    path.t = t;
    path.t_end = t_end;
    path.block = track.block;
}

// Goes on from path.origin in `direction`; `start_surface` is the surface on which the path starts, or NOTHING.
void redirect(inout Path path, vec3 direction, int start_surface, inout Random random) {
    Ray ray = make_ray(path.origin, direction);
    vec2 span = clip_ray(ray, 0.0);
    begin_flight(path, ray, span.x, span.y);
    path.surface = NOTHING;
    if (full_light) {
        find_surface(path, ray, start_surface, random);
    }
}

// Russian roulette (Arvo and Kirk 1990): 0 if the path ends, or the factor by which a surviving one becomes brighter,
// so that nothing continues that is darker than `least`.
float roulette(float brightness, float least, inout Random random) {
    if (brightness >= least) {
        return 1.0;
    }
    return random_numbers(random).x * least >= brightness ? 0.0 : least / brightness;
}

// Russian roulette for a shadow ray by its unoccluded radiance: many shadow rays would add next to nothing to light or
// noise.
vec3 shadow_roulette(vec3 radiance, inout Random random) {
    const float LEAST = 0.05; // of all lights together
    return radiance * roulette(max_component(radiance / scene.cache_unit), LEAST, random);
}

// Next-event estimation: sends a shadow ray that will bring `radiance` to path.origin; the flight goes
// on after it.
void aim_shadow_ray(inout Path path, vec3 direction, vec3 radiance, int start_surface) {
    if (max_component(radiance) <= 0.0) {
        return;
    }
    Ray ray = make_ray(path.origin, direction);
    vec2 span = clip_ray(ray, 0.0);
    Track track = track_from(ray, span.x, span.y);
    path.shadow_direction = direction;
    path.shadow_t = track.t;
    path.shadow_t_end = track.t_end;
    path.shadow_block = track.block;
    path.shadow_transmittance = 1.0;
    path.shadow_radiance = radiance;
    path.stage = STAGE_SHADOW;
    if (full_light) {
        Search search = begin_search(ray, span.x, start_surface, path.inside);
        if (is_in_bricks) {
            hold_search(path, search);
            path.searches = SEARCH_SHADOW;
        } else {
            search_shadow(path, ray, search);
        }
    }
}

// Sends a shadow ray to a sun from a collision at path.origin.
void aim_at_sun(inout Path path, inout Random random) {
    LightSample sun = sample_sun(random_numbers(random).x);
    vec3 radiance = path.throughput * phase_function(path.direction, sun.towards) * sun.radiance;
    aim_shadow_ray(path, sun.towards, shadow_roulette(radiance, random), NOTHING);
}

// Whether the path continues after an event, with Russian roulette where nothing else ends it. After MANY reflections, a
// further one may end a path whatever its throughput: in a closed surface that absorbs nothing it would go on for ever.
bool survives(inout Path path, bool is_reflected, inout Random random) {
    const float LEAST = 0.4;
    const uint MANY = 1024u;
    const float GOES_ON = 0.999;
    if (scene.max_bounces == 0u) {
        if (is_reflected && path.bounces - path.collisions > MANY) {
            path.throughput *= roulette(GOES_ON, 1.0, random);
        }
        path.throughput *= roulette(max_component(path.throughput), LEAST, random);
    }
    return max_component(path.throughput) > 0.0;
}

// Ends a path while its shadow ray is on its way: the flight that follows meets nothing.
void end_path(inout Path path) {
    path.throughput = vec3(0.0);
    path.t = 0.0;
    path.t_end = -1.0;
    path.surface = NOTHING;
}

// The surface or medium that scatters light where a segment ends.
struct Scatterer {
    bool is_surface;
    Hit hit;
    Material material;
    vec3 arriving; // direction of travel
};

Scatterer scatterer_of(Path path) {
    Scatterer s;
    s.is_surface = surface_count > 0u && (!has_medium || path.surface >= 0);
    s.arriving = path.direction;
    if (s.is_surface) {
        Ray ray = make_ray(path.origin, path.direction);
        s.hit = hit_at(ray, Crossing(path.t_end, path.surface, path.inside));
        s.material = make_material(uint(path.surface));
    }
    return s;
}

// The scatterer's response to light in a direction.
struct Response {
    vec3 value;    // BRDF times cosine, or phase function
    float pdf;     // of sampling by it, 1/sr
};

Response response_of(Scatterer s, vec3 direction) {
    if (s.is_surface) {
        return Response(brdf_value(s.material, s.hit.shading_normal, -s.arriving, direction)
                            * cosine_towards(s.hit, direction),
                        brdf_pdf(s.material, s.hit.shading_normal, -s.arriving, direction));
    }
    float phase = phase_function(s.arriving, direction);
    return Response(vec3(phase), phase);
}

// The path's next direction, with throughput and pdf; a throughput of 0 if it cannot go on.
vec3 sample_direction(inout Path path, Scatterer s, vec3 u) {
    if (s.is_surface) {
        vec3 direction = brdf_sample(s.material, s.hit.shading_normal, -s.arriving, u);
        Response response = response_of(s, direction);
        path.pdf = response.pdf;
        // A pdf of 0 is a lobe's edge, lost to rounding.
        path.throughput *= path.pdf > 0.0 ? response.value / path.pdf : vec3(0.0);
        return direction;
    }
    float x = phase_sample(u.x);
    path.pdf = phase_function_at(x);
    return scattered_direction(s.arriving, x, u.y);
}

// Sends a shadow ray and redirects the path. Code that surfaces and medium share is here only once: a device with wide
// lanes runs both sides of a branch.
void deflect(inout Path path, inout Random random) {
    Scatterer s = scatterer_of(path);
    int start_surface = s.is_surface ? path.surface : NOTHING;
    path.origin = end_of_flight(path);
    path.collisions += s.is_surface ? 0u : 1u;
    if (has_light_sampling) {
        LightSample light = sample_light(words_for_light(path, random));
        Response response = response_of(s, light.towards);
        float weight = light_weight(light, response.pdf);
        bool is_known = light.is_sun && has_suns_already(path);
        vec3 radiance = is_known ? vec3(0.0) : path.throughput * response.value * weight * light.radiance;
        aim_shadow_ray(path, light.towards, shadow_roulette(radiance, random), start_surface);
    }
    vec3 direction = sample_direction(path, s, numbers_for_direction(path, random).xyz);
    if (survives(path, s.is_surface, random)) {
        redirect(path, direction, start_surface, random);
    } else {
        end_path(path);
    }
}

// Scatters at the end of a segment. At a collision, the caller has already multiplied the throughput by the albedo.
void scatter(inout Path path, inout Random random) {
    if (path.bounces == 0u) {
        add_coverage(path, 1.0);
    }
    path.stage = STAGE_FLIGHT;
    if (scene.max_bounces > 0u && path.bounces >= scene.max_bounces) {
        end_path(path);
        return;
    }
    ++path.bounces;
    if (path.surface == COLLISION && end_in_cache(path, random)) {
        return;
    }
    deflect(path, random);
}

// Advances the path's shadow ray, if it has one, and then its flight.
//
// One loop for both: a lane's flight and its neighbour's shadow ray are advanced together, and a lane whose shadow
// ray is over does not wait.
void fly(inout Path path, inout Random random) {
    bool is_shadow = has_light_sampling && path.stage == STAGE_SHADOW;
    Ray ray = make_ray(path.origin, is_shadow ? path.shadow_direction : path.direction);
    Track track = Track(path.t, path.t_end, path.block);
    if (is_shadow) {
        track = Track(path.shadow_t, path.shadow_t_end, path.shadow_block);
    }
    Tracking tracking = begin_tracking(ray, track);
    uint steps = 0u;
    LOOP {
        Tracking before = tracking;
        Random random_before = random;
        uint lookups_before = lookups;
        float transmittance_before = path.shadow_transmittance;
        if (tracking.outcome == OUTCOME_PENDING) {
            step_tracking(tracking, is_shadow, random, path.value, path.shadow_transmittance);
        }
        // A step that is void is undone.
        bool is_last = is_void;
        if (is_last && steps > 0u) {
            tracking = before;
            random = random_before;
            lookups = lookups_before;
            path.shadow_transmittance = transmittance_before;
            clear_void();
        }
        // The compiler knows `has_light_sampling`, and leaves the branch out without it.
        if (has_light_sampling && is_shadow && tracking.outcome == OUTCOME_END) {
            contribute(path, path.shadow_transmittance * path.shadow_radiance);
            is_shadow = false;
            Track flight = Track(path.t, path.t_end, path.block);
            tracking = begin_tracking(make_ray(path.origin, path.direction), flight);
        }
        ++steps;
        if (steps == steps_at_once() || is_last || !is_shadow && tracking.outcome != OUTCOME_PENDING) {
            break;
        }
    }
    if (is_shadow) {
        path.shadow_t = tracking.t;
        path.shadow_block = tracking.walk.cell;
        return;
    }
    path.t = tracking.t;
    path.block = tracking.walk.cell;
    path.stage = tracking.outcome == OUTCOME_PENDING ? STAGE_FLIGHT : STAGE_ARRIVAL;
    if (tracking.outcome == OUTCOME_COLLISION) {
        path.t_end = path.t;
        path.surface = COLLISION;
    }
}

// Advances the path, and handles the event at its end.
void advance_once(inout Path path) {
    Random random = random_of(path);
    if (is_in_bricks && surface_count > 0u && path.searches != 0u) {
        continue_search(path, random);
        path.dimension = random.dimension;
        return;
    }
    if (path.stage != STAGE_IDLE) {
        fly(path, random);
    }
    if (path.stage == STAGE_ARRIVAL) {
        if (path.surface == NOTHING) {
            escape(path);
            path.stage = STAGE_IDLE;
        } else {
            if (path.surface == COLLISION) {
                path.throughput *= albedo_of(path.value);
            }
            scatter(path, random);
        }
    }
    path.dimension = random.dimension;
}

// Advances the path, twice where there are surfaces: finding a new path's first surface is expensive, and cheaper if
// several lanes whose paths have ended do it together. Where the volume streams, searches are put off anyhow. (A loop of a
// single iteration would still be a loop to a driver.)
void advance(inout Path path) {
    if (surface_count == 0u || is_in_bricks) {
        advance_once(path);
        return;
    }
    bool again = true;
    LOOP {
        advance_once(path);
        if (!again || path.stage == STAGE_IDLE || is_void) {
            break;
        }
        again = false;
    }
}
