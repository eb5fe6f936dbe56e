// What a path does on its way, wherever it began: it flies, meets surfaces, scatters, and asks for
// light with shadow rays. It advances event by event and keeps its whole state in a `Path`, so that it
// can wait for the next dispatch anywhere.
//
// Who includes this says what becomes of what a path finds:

// `radiance` arrives where the path began.
void contribute(inout Path path, vec3 radiance);
// The path's first segment meets medium or surface with this share of its light.
void cover(inout Path path, float share);
// The path leaves the box.
void escape(inout Path path);
// At a collision: takes all that it will bring and ends the path there, if that can be known.
bool collect(inout Path path, inout Random random);
// Goes on with a flight by other means than waiting for a collision, if there are any.
bool march(inout Path path, Ray ray, inout Random random);

// What stands at path.t_end besides a surface's index.
const int NOTHING = -1;
const int COLLISION = -2;

Random random_of(Path path) {
    return Random(path.pixel, path.sample_index, path.dimension);
}

// A surface on which the path starts, or −1: surfaces exist beyond the camera's segment only in
// `full` light.
int starting_surface(Path path) {
    return full_light ? path.surface : NOTHING;
}

// A new path at path.origin, with nothing behind it.
void begin_path(inout Path path) {
    path.dimension = 0u;
    path.phase = PHASE_FLIGHT;
    path.bounces = 0u;
    path.collisions = 0u;
    path.throughput = vec3(1.0);
    path.transmittance = 1.0;
    path.pdf = ALONE;
    path.inside = 0u;
    path.t = 0.0;
    path.surface = NOTHING;
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

// Product of 1 − opacity over the crossings of `ray` in [t, t_end].
float surface_transmittance(Ray ray, float t, float t_end, int known, uint inside) {
    Crossing crossing = Crossing(t, NOTHING, inside);
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

// The path turns into `direction` at path.origin; `known` is the surface it starts on, or −1.
void turn(inout Path path, vec3 direction, int known, inout Random random) {
    path.direction = direction;
    Ray ray = make_ray(path.origin, direction);
    vec2 span = clip_ray(ray, 0.0);
    path.t = span.x;
    path.t_end = span.y;
    path.transmittance = 1.0;
    path.surface = NOTHING;
    if (full_light) {
        find_surface(path, ray, known, true, random);
    }
}

// Next-event estimation: sends a shadow ray that will bring `radiance` to the point path.shadow_from
// along the path; the path goes on with `next_phase`.
void aim_shadow_ray(inout Path path, vec3 direction, vec3 radiance, int known, uint next_phase) {
    path.next_phase = next_phase;
    path.phase = next_phase;
    if (max(radiance.x, max(radiance.y, radiance.z)) <= 0.0) {
        return;
    }
    Ray ray = make_ray(path.origin + path.shadow_from * path.direction / scene.spacing, direction);
    vec2 span = clip_ray(ray, 0.0);
    path.shadow_direction = direction;
    path.shadow_t = span.x;
    path.shadow_t_end = span.y;
    path.shadow_radiance = radiance;
    if (full_light) {
        path.shadow_radiance *= surface_transmittance(ray, span.x, span.y, known, path.inside);
    }
    path.phase = PHASE_SHADOW;
}

void scatter_in_medium(inout Path path, inout Random random) {
    ++path.collisions;
    path.throughput *= transfer_color(path.value);
    path.origin += path.t_end * path.direction / scene.spacing;
    if (has_light_sampling) {
        LightSample light = sample_light(random_words(random));
        float density = phase_density(dot(path.direction, light.direction));
        vec3 radiance = path.throughput * density * light_weight(light, density) * light.radiance;
        aim_shadow_ray(path, light.direction, radiance, NOTHING, PHASE_FLIGHT);
    }
    vec4 u = random_numbers(random);
    float cosine = phase_sample_cosine(u.x);
    vec3 direction = direction_around(path.direction, cosine, u.y);
    path.pdf = phase_density(cosine);
    turn(path, direction, NOTHING, random);
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
            aim_shadow_ray(path, l, radiance, s, PHASE_FLIGHT);
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
    path.surface = NOTHING;
}

void scatter(inout Path path, inout Random random) {
    if (path.bounces == 0u) {
        cover(path, path.transmittance);
    }
    path.phase = PHASE_FLIGHT;
    path.shadow_from = 0.0;
    if (scene.max_bounces > 0u && path.bounces >= scene.max_bounces) {
        end_path(path);
        return;
    }
    ++path.bounces;
    bool alive = true;
    if (path.surface == COLLISION && collect(path, random)) {
        return;
    }
    if (path.surface >= 0) {
        alive = reflect_at_surface(path, random);
    } else {
        scatter_in_medium(path, random);
    }
    if (!alive || !survives(path, random)) {
        end_path(path);
    }
}


// A free flight to the next collision, to a surface or to the end.
void fly(inout Path path, Ray ray, inout Random random) {
    uint outcome = OUTCOME_END;
    if (has_medium) {
        outcome = track_collision(ray, path.t, path.t_end, random, path.value);
    }
    if (outcome == OUTCOME_COLLISION) {
        path.t_end = path.t;
        path.surface = COLLISION;
    }
    if (outcome != OUTCOME_PENDING) {
        path.phase = PHASE_ARRIVAL;
    }
}

// Takes the path to its next event and handles it.
void advance(inout Path path) {
    Random random = random_of(path);
    if (path.phase == PHASE_FLIGHT) {
        Ray ray = make_ray(path.origin, path.direction);
        if (!march(path, ray, random)) {
            fly(path, ray, random);
        }
    }
    if (path.phase == PHASE_ARRIVAL) {
        if (path.surface == NOTHING) {
            escape(path);
            path.phase = PHASE_IDLE;
        } else {
            scatter(path, random);
        }
    }
    if (has_light_sampling && path.phase == PHASE_SHADOW) {
        vec3 from = path.origin + path.shadow_from * path.direction / scene.spacing;
        Ray shadow = make_ray(from, path.shadow_direction);
        float transmittance = 1.0;
        uint outcome = OUTCOME_END;
        if (has_medium) {
            outcome = track_transmittance(shadow, path.shadow_t, path.shadow_t_end, random,
                                          transmittance);
        }
        path.shadow_radiance *= transmittance;
        if (outcome == OUTCOME_END) {
            contribute(path, path.shadow_radiance);
            path.phase = path.next_phase;
        }
    }
    path.dimension = random.dimension;
}
