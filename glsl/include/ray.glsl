// Rays have their position in grid space and their direction in world space: x(t) = origin + t·step, where step =
// direction / spacing, so that t is a world length.

#include "scene.glsl"

layout(scalar) readonly buffer ClipBlock { Clip at[]; } clips;

struct Ray {
    vec3 origin;    // grid space
    vec3 step;      // grid units per world length
    vec3 direction; // world space, unit
};

Ray make_ray(vec3 origin, vec3 direction) {
    return Ray(origin, direction / scene.spacing, direction);
}

vec3 to_grid(vec3 world) {
    return (world + scene.half_extent) / scene.spacing + 0.5;
}

vec3 to_world(vec3 grid) {
    return (grid - 0.5) * scene.spacing - scene.half_extent;
}

// The part of the ray inside the box and the clip planes; empty if x ≥ y. The body is convex, so the part is one
// interval. Zero components of `step` are handled separately: a division by them would give NaN on a face. The slab method
// (Kay and Kajiya, "Ray Tracing Complex Scenes", 1986).
vec2 clip_ray(Ray ray, float from) {
    float t0 = from;
    float t1 = LARGEST;
    for (int a = 0; a < 3; ++a) {
        float low = 0.5 - ray.origin[a];
        float high = float(scene.dims[a]) + 0.5 - ray.origin[a];
        if (ray.step[a] == 0.0) {
            if (low > 0.0 || high < 0.0) {
                return vec2(1.0, 0.0);
            }
            continue;
        }
        float one = low / ray.step[a];
        float two = high / ray.step[a];
        t0 = max(t0, min(one, two));
        t1 = min(t1, max(one, two));
    }
    vec3 origin = to_world(ray.origin);
    for (uint c = 0u; c < clip_count; ++c) {
        float over = dot(clips.at[c].normal, origin) - clips.at[c].offset;
        float rate = dot(clips.at[c].normal, ray.direction);
        if (rate > 0.0) {
            t1 = min(t1, -over / rate);
        } else if (rate < 0.0) {
            t0 = max(t0, -over / rate);
        } else if (over > 0.0) {
            return vec2(1.0, 0.0);
        }
    }
    return vec2(t0, t1);
}

// A walk of a ray through boxes of `size` grid units on a lattice from the grid's origin (Amanatides and Woo, "A Fast Voxel
// Traversal Algorithm for Ray Tracing", 1987).
struct Walk {
    ivec3 cell;
    float exit;   // t at which the ray leaves the cell
    ivec3 next;   // from the cell to the next one
    // Properties of the ray. No component is ever picked by an index that is not a constant, since compilers keep
    // vectors that are indexed in that way in memory.
    vec3 inverse; // 1 / step; 0 where the ray never leaves along an axis
    vec3 ahead;   // 1 where the cell's upper side is the one that is left
};

void find_exit(inout Walk walk, Ray ray, float size) {
    // Recomputed from the cell's index each time, so that no error adds up along the ray.
    vec3 sides = (vec3(walk.cell) + walk.ahead) * size;
    vec3 t = mix((sides - ray.origin) * walk.inverse, vec3(LARGEST), equal(walk.inverse, vec3(0.0)));
    walk.exit = min(t.x, min(t.y, t.z));
    bool x = t.x == walk.exit;
    bool y = !x && t.y == walk.exit;
    walk.next = ivec3(sign(walk.inverse)) * ivec3(x, y, !x && !y);
}

// A walk that begins in a known cell.
Walk walk_from(Ray ray, ivec3 cell, float size) {
    Walk walk;
    walk.cell = cell;
    walk.inverse = mix(1.0 / ray.step, vec3(0.0), lessThan(abs(ray.step), vec3(1e-30)));
    walk.ahead = vec3(greaterThan(ray.step, vec3(0.0)));
    find_exit(walk, ray, size);
    return walk;
}

ivec3 cell_at(Ray ray, float t, float size, ivec3 cells) {
    return clamp(ivec3(floor((ray.origin + t * ray.step) / size)), ivec3(0), cells - 1);
}

Walk begin_walk(Ray ray, float t, float size, ivec3 cells) {
    return walk_from(ray, cell_at(ray, t, size, cells), size);
}

// Returns false once the ray has left the lattice.
bool step_walk(inout Walk walk, Ray ray, float size, ivec3 cells) {
    ivec3 next = walk.cell + walk.next;
    if (next != clamp(next, ivec3(0), cells - 1)) {
        return false;
    }
    walk.cell = next;
    find_exit(walk, ray, size);
    return true;
}
