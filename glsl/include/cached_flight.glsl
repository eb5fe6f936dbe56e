// Paths that read the cache: at a collision, which then ends them. Where a surface cuts a cube, its nodes
// may lie behind the surface: there a path scatters as if there were no cache.
//
// Without surfaces, the camera's own segment is marched instead: it takes the light that the cache holds
// all along its way, and so has next to no noise. (With surfaces their noise is what is seen, and a
// march costs several collisions.)

// Below this nothing behind is seen: a float's last digits.
const float OPAQUE_BELOW = 1e-6;

// Whether the collision at path.t_end may take its light from the cache.
bool reads_cache(Path path) {
    vec3 g = path.origin + path.t_end * path.direction / scene.spacing;
    return path.collisions + 1u >= cache_order && !(full_light && is_cut(cube_at(g)));
}

// The end of a path at a collision, with a shadow ray for the suns.
bool collect(inout Path path, inout Random random) {
    if (!reads_cache(path)) {
        return false;
    }
    vec3 g = path.origin + path.t_end * path.direction / scene.spacing;
    vec3 throughput = path.throughput * transfer_color(path.value);
    CachedLight light = read_cache(cube_at(g));
    contribute(path, throughput * scattered_light(light, -path.direction));
    path.origin = g;
    if (sun_count > 0u) {
        LightSample sun = sample_sun(random_numbers(random).x);
        float density = phase_density(dot(path.direction, sun.direction));
        aim_shadow_ray(path, sun.direction, throughput * density * sun.radiance, NOTHING,
                       PHASE_FLIGHT);
    }
    end_path(path);
    return true;
}

// The suns' part of what the march took from the cache, made exact: a shadow ray from a place picked
// in proportion to what it contributed, against what the cache says there.
void correct_suns(inout Path path, Ray ray, inout Random random) {
    vec3 g = ray.origin + path.pick_t * ray.step;
    vec3 share = path.throughput * (1.0 - path.transmittance)
               * transfer_color(lookup(ray, path.pick_t));
    contribute(path, -share * read_cache(cube_at(g)).suns * suns_scattered(-path.direction));
    LightSample light = sample_sun(random_numbers(random).x);
    float density = phase_density(dot(path.direction, light.direction));
    path.shadow_from = path.pick_t;
    aim_shadow_ray(path, light.direction, share * density * light.radiance, NOTHING,
                   PHASE_ARRIVAL);
}

// The end of a march: what is left of the path goes on to what stands there.
void settle(inout Path path, Ray ray, inout Random random) {
    cover(path, 1.0 - path.transmittance);
    path.phase = PHASE_ARRIVAL;
    vec3 throughput = path.throughput;
    if (sun_count > 0u && path.transmittance < 1.0) {
        correct_suns(path, ray, random);
    }
    path.throughput = throughput * path.transmittance;
}

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
    vec4 first = transfer_at(values.x);
    vec4 second = transfer_at(values.y);
    vec2 depths = scene.density * size * vec2(first.a, second.a);
    float mean = 0.5 * (depths.x + depths.y);
    float variance = 0.25 * (depths.x - depths.y) * (depths.x - depths.y);
    vec2 shares = mean > 0.0 ? 0.5 * depths / mean : vec2(0.5);
    MarchStep s;
    s.absorbed = absorbed_by(mean) + 0.5 * variance * (1.0 - absorbed_by(mean));
    s.albedo = shares.x * first.rgb + shares.y * second.rgb;
    s.t = dot(shares, places);
    s.picked_t = u.z < shares.x ? places.x : places.y;
    return s;
}

// Marches the camera's segment. Light is read once for as many steps as there are voxels between nodes.
bool march(inout Path path, Ray ray, inout Random random) {
    if (!has_medium || cache_order > 1u || surface_count > 0u || path.bounces > 0u) {
        return false;
    }
    Walk walk = begin_walk(ray, path.t, float(MACROCELL), ivec3(scene.macrocells));
    vec3 suns_here = suns_scattered(-path.direction);
    Taken taken = Taken(vec3(0.0), 0.0, 0.0);
    bool onwards = true;
    for (uint i = 1u; onwards && i <= STEPS; ++i) {
        float size = 0.0;
        onwards = next_step(ray, walk, path.t, path.t_end, size);
        vec4 u = random_numbers(random);
        MarchStep s = sample_step(ray, path.t, size, u.xyz);
        s.absorbed = onwards ? s.absorbed : 0.0;
        path.t += onwards ? size : 0.0;
        float weight = path.transmittance * s.absorbed;
        path.transmittance -= weight;
        take(taken, weight, s.albedo, s.t);
        if (u.w * (1.0 - path.transmittance) < weight) {
            path.pick_t = s.picked_t;
        }
        if (path.transmittance < OPAQUE_BELOW) {
            path.transmittance = 0.0;
            onwards = false;
        }
        if (!onwards || i % scene.cache_stride == 0u) {
            contribute(path, path.throughput * light_taken(taken, ray, suns_here));
            taken = Taken(vec3(0.0), 0.0, 0.0);
        }
    }
    if (!onwards) {
        settle(path, ray, random);
    }
    return true;
}
