// Null-collision tracking against majorants block by block (Woodcock et al. 1965; Novák et al. 2014 for ratio
// tracking; piecewise-constant majorants as in pbrt-v4, 11.2.2).
//
// Paths stop tracking after a few tentative collisions and resume where they stopped: the exponential distribution
// has no memory. That bounds the time of a dispatch whatever the medium, and lanes that have arrived do not wait long
// for their neighbours.

#include "scene.glsl"
#include "loop.glsl"
#include "medium.glsl"
#include "random.glsl"
#include "ray.glsl"
#include "volume.glsl"

// Largest extinction in each block, per world unit.
LOADED_AS(r32f) uniform texels3D majorants;

float majorant_of(ivec3 block) {
    return texel_at(majorants, block).r;
}

// Tentative collisions after which a thread stops tracking, so that lanes whose flight has ended need not wait longer.
// Where there are surfaces the number is larger: the search for surfaces that follows is expensive, and is cheaper if
// several lanes do it together.
uint steps_at_once() {
    return surface_count == 0u ? 4u : 8u;
}

const uint OUTCOME_PENDING = 0u;
const uint OUTCOME_COLLISION = 1u;
const uint OUTCOME_END = 2u;

// What a path keeps of its tracking between dispatches: a ray in [t, t_end].
struct Track {
    float t, t_end;
    ivec3 block; // at t
};

Track track_from(Ray ray, float t, float t_end) {
    return Track(t, t_end, cell_at(ray, t, scene.block_size, ivec3(scene.blocks)));
}

// Tracking under way: the ray, the walk through the blocks, and the outcome.
struct Tracking {
    Ray ray;
    float t, t_end;
    Walk walk;
    float majorant; // of the walk's block
    uint outcome;
};

Tracking begin_tracking(Ray ray, Track track) {
    Walk walk = walk_from(ray, track.block, scene.block_size);
    bool goes_on = has_medium && track.t < track.t_end;
    return Tracking(ray, track.t, track.t_end, walk, majorant_of(walk.cell),
                    goes_on ? OUTCOME_PENDING : OUTCOME_END);
}

// Moves t on to the next tentative collision; false if t_end comes first.
bool next_tentative(inout Tracking tracking, float optical_depth) {
    float size = scene.block_size;
    ivec3 cells = ivec3(scene.blocks);
    LOOP {
        float exit = min(tracking.walk.exit, tracking.t_end);
        float here = tracking.majorant * max(exit - tracking.t, 0.0);
        if (optical_depth < here) {
            tracking.t = min(tracking.t + optical_depth / tracking.majorant, exit);
            return true;
        }
        optical_depth -= here;
        tracking.t = max(tracking.t, exit);
        bool inside = tracking.walk.exit < tracking.t_end
                   && step_walk(tracking.walk, tracking.ray, size, cells);
        tracking.majorant = majorant_of(tracking.walk.cell);
        if (!inside) {
            break;
        }
    }
    tracking.t = tracking.t_end;
    return false;
}

// Reads of the volume by tracking and by marches.
uint lookups = 0u;

Corners corners_read(ivec3 cell) {
    ++lookups;
    iterations += 2u;
    return volume_corners(cell);
}

float lookup_at(vec3 g) {
    vec3 cell = floor(g);
    return value_in(corners_read(ivec3(cell)), g - cell);
}

float lookup(Ray ray, float t) {
    return lookup_at(ray.origin + t * ray.step);
}

// V at a tentative collision. Where opacity is linear in V, one of the eight voxels around is picked, with its
// interpolation weight as the probability: σt is the same on average, and with it the expected path, in which σt
// appears as a probability or as a factor (Pharr et al., "Filtering After Shading With Stochastic Texture Filtering",
// 2024). That reads one texel instead of eight, and avoids a filter's rounding.
float tentative_value(Ray ray, float t, uvec2 words) {
    if (!is_linear) {
        return lookup(ray, t);
    }
    ++lookups;
    iterations += 2u;
    vec3 u = vec3(words.x >> 16u, words.x & 0xFFFFu, words.y >> 16u) * exp2(-16.0);
    return volume_voxel(ivec3(floor(ray.origin + t * ray.step - u)));
}

// A step of delta tracking to a real collision, with stored value `value`; or, for a shadow ray, of ratio
// tracking: `transmittance` is multiplied on the way, and goes through Russian roulette once it is small,
// so that it reaches exactly 0 or t_end.
void step_tracking(inout Tracking tracking, bool is_shadow, inout Random random, inout float value,
                   inout float transmittance) {
    const float ROULETTE_BELOW = 0.3;
    uvec4 words = random_words(random);
    bool collides = next_tentative(tracking, exponential(words.x));
    tracking.outcome = collides ? OUTCOME_PENDING : OUTCOME_END;
    if (collides) {
        value = tentative_value(tracking.ray, tracking.t, words.zw);
        float sigma_t = sigma_t_of(value);
        float u = unit_interval(words.y);
        if (!is_shadow) {
            tracking.outcome = u * tracking.majorant < sigma_t ? OUTCOME_COLLISION : OUTCOME_PENDING;
        } else {
            transmittance *= max(0.0, 1.0 - sigma_t / tracking.majorant);
            if (transmittance < ROULETTE_BELOW) {
                bool dies = u * ROULETTE_BELOW >= transmittance;
                transmittance = dies ? 0.0 : ROULETTE_BELOW;
                tracking.outcome = dies ? OUTCOME_END : OUTCOME_PENDING;
            }
        }
    }
}
