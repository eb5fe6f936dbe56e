// Searches for surfaces along the flight and the shadow ray. Where the volume streams, the bricks along a whole ray may
// be more than there is room for: there a search is put off, and goes on brick by brick, with the same result.

#include "scene.glsl"
#include "loop.glsl"
#include "random.glsl"
#include "ray.glsl"
#include "surface.glsl"
#include "volume_bricks.glsl"

float max_component(vec3 color) {
    return max(color.x, max(color.y, color.z));
}

// Follows the flight through its surfaces: each reflects with its opacity. Leaves path.t_end at the first that does, or
// at the end.
void search_flight(inout Path path, Ray ray, inout Search search, inout Random random) {
    Crossing crossing;
    LOOP {
        crossing = find_crossing(ray, path.t_end, search);
        bool through = crossing.surface >= 0
                    && random_numbers(random).x >= surface_at(uint(max(crossing.surface, 0))).opacity;
        if (!through) {
            break;
        }
        pass_through(ray, crossing, search);
    }
    if (!is_void) {
        path.surface = crossing.surface;
        path.inside = crossing.inside;
        path.t_end = crossing.surface >= 0 ? crossing.t : path.t_end;
    }
}

// Follows the shadow ray through its surfaces: each takes its opacity's share of the light.
void search_shadow(inout Path path, Ray ray, inout Search search) {
    attenuate(ray, path.shadow_t_end, search, path.shadow_transmittance);
    if (!is_void) {
        path.shadow_radiance *= path.shadow_transmittance;
        path.shadow_transmittance = 1.0;
        path.stage = max_component(path.shadow_radiance) > 0.0 ? STAGE_SHADOW : STAGE_FLIGHT;
    }
}

Search held_search(Path path) {
    return Search(path.search_t, path.search_macrocell, path.search_start_surface, path.search_is_fresh != 0u,
                  path.search_inside);
}

void hold_search(inout Path path, Search search) {
    path.search_t = search.t;
    path.search_macrocell = search.macrocell;
    path.search_start_surface = search.start_surface;
    path.search_is_fresh = search.fresh ? 1u : 0u;
    path.search_inside = search.inside;
}

// The search for the flight's surface; path.surface is the one on which the flight starts, or NOTHING.
Search begin_flight_search(Path path, Ray ray) {
    return begin_search(ray, path.t, path.surface, path.inside);
}

// Goes on with the search that was put off, as far as there are bricks.
void continue_search(inout Path path, inout Random random) {
    bool is_shadow = (path.searches & SEARCH_SHADOW) != 0u;
    Search search = held_search(path);
    float t = search.t;
    if (is_shadow) {
        search_shadow(path, make_ray(path.origin, path.shadow_direction), search);
    } else {
        search_flight(path, make_ray(path.origin, path.direction), search, random);
    }
    if (is_void) {
        hold_search(path, search);
        if (search.t > t) {
            clear_void();
        }
        return;
    }
    path.searches &= is_shadow ? ~SEARCH_SHADOW : ~SEARCH_FLIGHT;
    if (path.searches != 0u) {
        hold_search(path, begin_flight_search(path, make_ray(path.origin, path.direction)));
    }
}

// Searches for the surface at the flight's end; the flight starts on `start_surface`, or on none.
void find_surface(inout Path path, Ray ray, int start_surface, inout Random random) {
    path.surface = start_surface;
    Search search = begin_flight_search(path, ray);
    if (!is_in_bricks) {
        search_flight(path, ray, search, random);
        return;
    }
    if (path.searches == 0u) {
        hold_search(path, search);
    }
    path.searches |= SEARCH_FLIGHT;
}
