// Null-collision tracking against the macrocells' majorants (Woodcock et al. 1965; Novák et al.
// 2014 for ratio tracking; piecewise-constant majorants as in pbrt-v4, 11.2.2).
//
// Both walks stop after STEPS tentative collisions and can be resumed where they stopped: the
// exponential distribution has no memory. That bounds the time of a dispatch whatever the medium.

// Largest extinction in each macrocell, per world unit.
layout(binding = 5) uniform sampler3D majorants;

float macrocell_majorant(ivec3 macrocell) {
    return texelFetch(majorants, macrocell, 0).r;
}

const uint STEPS = 32u;

const uint OUTCOME_PENDING = 0u;
const uint OUTCOME_COLLISION = 1u;
const uint OUTCOME_END = 2u;

// Moves t on to the next tentative collision, or to t_end. Returns the majorant there, or −1.
float next_tentative(Ray ray, inout Walk walk, inout float t, float t_end, float optical_depth) {
    const float size = float(MACROCELL);
    ivec3 cells = ivec3(scene.macrocells);
    float majorant = macrocell_majorant(walk.cell);
    bool inside = true;
    while (inside) {
        float exit = min(walk.exit, t_end);
        float here = majorant * max(exit - t, 0.0);
        if (optical_depth < here) {
            t = min(t + optical_depth / majorant, exit);
            return majorant;
        }
        optical_depth -= here;
        t = max(t, exit);
        inside = walk.exit < t_end && step_walk(walk, ray, size, cells);
        majorant = macrocell_majorant(walk.cell);
    }
    t = t_end;
    return -1.0;
}

// Reads of the volume by tracking.
uint lookups = 0u;

float lookup(Ray ray, float t) {
    ++lookups;
    work += 2u + uint(findMSB(scene.transfer_points));
    return volume_value(ray.origin + t * ray.step);
}

// Delta tracking from t: to a real collision at t with stored value `value`, or to t_end.
uint track_collision(Ray ray, inout float t, float t_end, inout Random random, out float value) {
    value = 0.0;
    if (!(t < t_end)) {
        return OUTCOME_END;
    }
    Walk walk = begin_walk(ray, t, float(MACROCELL), ivec3(scene.macrocells));
    for (uint i = 0u; i < STEPS; ++i) {
        uvec4 words = random_words(random);
        float majorant = next_tentative(ray, walk, t, t_end, exponential(words.x));
        if (majorant < 0.0) {
            return OUTCOME_END;
        }
        value = lookup(ray, t);
        float sigma_t = scene.density * transfer_opacity(value);
        if (unit_interval(words.y) * majorant < sigma_t) {
            return OUTCOME_COLLISION;
        }
    }
    return OUTCOME_PENDING;
}

// Ratio tracking from t: `transmittance` is multiplied on the way, and goes through Russian roulette
// once it is small, so that it reaches exactly 0 or t_end.
uint track_transmittance(Ray ray, inout float t, float t_end, inout Random random,
                         inout float transmittance) {
    const float ROULETTE_BELOW = 0.1;
    if (!(t < t_end)) {
        return OUTCOME_END;
    }
    Walk walk = begin_walk(ray, t, float(MACROCELL), ivec3(scene.macrocells));
    for (uint i = 0u; i < STEPS; ++i) {
        uvec4 words = random_words(random);
        float majorant = next_tentative(ray, walk, t, t_end, exponential(words.x));
        if (majorant < 0.0) {
            return OUTCOME_END;
        }
        float sigma_t = scene.density * transfer_opacity(lookup(ray, t));
        transmittance *= max(0.0, 1.0 - sigma_t / majorant);
        if (transmittance < ROULETTE_BELOW) {
            if (unit_interval(words.y) * ROULETTE_BELOW >= transmittance) {
                transmittance = 0.0;
                return OUTCOME_END;
            }
            transmittance = ROULETTE_BELOW;
        }
    }
    return OUTCOME_PENDING;
}
