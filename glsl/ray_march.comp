// The picture that the cache shows at once, for a moving camera: one ray through each pixel's centre, marched front
// to back; at rest, the mean of a few through other points as well. Surfaces are exact hits. The light of the suns on
// them is marched to as well (sunlit.glsl); they reflect all other light by the two moments of it that the cache holds
// (reflectance.glsl). Where the cache holds none, far from the medium, that is the sky's light.

#version 460
#include "scene.glsl"
#include "brdf.glsl"
#include "bricks.glsl"
#include "cache.glsl"
#include "camera.glsl"
#include "camera_ray.glsl"
#include "light.glsl"
#include "loop.glsl"
#include "march.glsl"
#include "marched.glsl"
#include "nodes.glsl"
#include "pages.glsl"
#include "push.glsl"
#include "random.glsl"
#include "ray.glsl"
#include "reflectance.glsl"
#include "scattered.glsl"
#include "sunlit.glsl"
#include "surface.glsl"
#include "taken.glsl"
#include "volume_bricks.glsl"

layout(local_size_x = 8, local_size_y = 8) in;
layout(rgba32f) uniform image2D unit_sum;

// Radiance and transmittance of a ray, front to back, up to where the march is.
struct Front {
    vec3 radiance;
    vec3 from_cache; // the part of it by which the cache's error is measured (`MARCH_CACHED`)
    float transmittance;
};

// A number in [0, 1) that depends on the thread and on `value` alone, for decisions that need no stream of numbers.
float number_at(float value) {
    Random random = Random(gl_GlobalInvocationID.x, gl_GlobalInvocationID.y, floatBitsToUint(value));
    return random_numbers(random).x;
}

// Number of rays along both axes of the picture.
uvec2 rays() {
    return (scene.size + push.stride - 1u) / push.stride;
}

// The brick of the node that is nearest to a point.
ivec3 nearest_brick(Cube cube) {
    ivec3 node = cube.low + ivec3(greaterThan(cube.p, vec3(0.5)));
    return min(node, ivec3(scene.cache_nodes) - 1) / BRICK;
}

// Adds the square of a read's weight, divided by the number of rays, to `Brick.squared_weight` of the nearest node's brick. It is
// rounded at random, so that many small terms are not lost, and never to 0: all bricks of a thin medium have small weights,
// and a brick of weight 0 may count as out of sight.
void weigh(Cube cube, float weight) {
    ivec3 brick = nearest_brick(cube);
    if (page_of(brick) != NO_PLACE) {
        uvec2 count = rays();
        float share = weight * weight / float(count.x * count.y);
        uint rounded = max(uint(share * exp2(31.0) + number_at(weight)), uint(weight > 0.0));
        atomicAdd(bricks.at[place_of(brick)].squared_weight, rounded);
    }
}

// Marks the brick of light at `cube` as read, though the picture at rest does without it.
void note_reading(Cube cube) {
    ivec3 brick = nearest_brick(cube);
    if (page_of(brick) != NO_PLACE) {
        atomicMax(bricks.at[place_of(brick)].squared_weight, 1u);
    }
}

// The light that the medium scatters at a point on this side of the surfaces.
CachedLight light_in(Cube cube, uint side) {
    CachedLight light = read_cache(cube);
    if (full_light && is_cut(cube)) {
        read_on_side(cube, side, light);
    }
    return light;
}

void march_segment(Ray ray, float t, float t_end, uint side, uint weighs, inout Front front) {
    if (!has_medium || !(t < t_end)) {
        return;
    }
    March march = begin_march(ray, t, t_end);
    vec3 suns_here = suns_scattered(-ray.direction);
    if (!march.goes_on) {
        return;
    }
    bool is_opaque;
    // Loops over stretches, reads of the cache, and steps.
    LOOP {
        LOOP {
            Taken taken = NOTHING_TAKEN;
            LOOP {
                MarchStep s = make_step(ray, march);
                float weight = front.transmittance * s.alpha;
                is_opaque = front.transmittance - weight <= OPAQUE_BELOW;
                // The transmittance that is left counts as absorbed and scattered here: what is behind is left out, which
                // loses less than OPAQUE_BELOW of its light.
                weight = is_opaque ? front.transmittance : weight;
                front.transmittance -= weight;
                take(taken, weight, s.albedo, mean_collision(s));
                if (is_opaque || !march.goes_on || is_due(taken)) {
                    break;
                }
            }
            Cube cube = cube_taken(taken, ray);
            // This loop has at most one turn. In place of an `if`, lavapipe makes faster code of it.
            for (uint k = 0u; k < weighs; ++k) {
                weigh(cube, taken.weight);
            }
            CachedLight light = light_in(cube, side);
            vec3 albedo = albedo_taken(taken);
            vec3 scattered = albedo * scattered_back(light, ray);
            front.from_cache += scattered;
            // A loop in place of an `if`, as above: it runs only for MARCH_AT_REST.
            for (uint k = MARCH_CACHED; k < push.wanted; ++k) {
                front.from_cache -= is_left_to_paths(cube) ? scattered : vec3(0.0);
            }
            front.radiance += scattered + albedo * light.suns * suns_here;
            if (is_opaque || !march.goes_on) {
                break;
            }
        }
        if (is_opaque) {
            break;
        }
        next_stretch(ray, march);
        if (!march.goes_on) {
            break;
        }
    }
}

// All light except the suns' that arrives at a surface on one of its sides. Where none of the nodes on this side of the
// surface knows its light, it is looked for farther in front of the surface.
CachedLight light_on(vec3 g, vec3 geometric, uint side, uint weighs) {
    const float FARTHEST = 4.0; // nodes
    CachedLight light = CachedLight(escaping_radiance(geometric, NO_MIS) / scene.cache_unit, 0.0, mat3(0.0), false);
    if (!has_medium) {
        return light;
    }
    vec3 to_next = geometric / scene.spacing;
    to_next /= length(to_next / scene.cache_step);
    Cube cube;
    bool is_read = false;
    float distance = 0.0;
    LOOP {
        cube = cube_at(g + distance * to_next);
        is_read = read_on_side(cube, side, light) || is_read;
        if (light.known || !full_light || distance == FARTHEST) {
            break;
        }
        distance += 1.0;
    }
    if (is_read && has_surface_fluxes) {
        light.flux = flux_between_even_nodes(cube, side, light.mean);
    }
    if (is_read && weighs != 0u) {
        note_reading(cube);
    }
    return light;
}

vec3 shade(Ray ray, Crossing crossing, uint weighs) {
    Hit hit = hit_at(ray, crossing);
    Material material = make_material(uint(crossing.surface));
    vec3 g = ray.origin + crossing.t * ray.step;
    CachedLight light = light_on(g, hit.geometric_normal, side_of_surfaces(crossing.inside), weighs);
    vec3 reflected = reflected_light(uint(crossing.surface), material, hit.shading_normal, -ray.direction, light);
    return reflected * scene.cache_unit + sunlight_reflected(ray, crossing, hit, material, OPAQUE_BELOW);
}

// The light of the ray through a pixel; with `weighs`, bricks get their weights. Once has_time_for_suns() is false, one of
// the remaining crossings, picked in proportion to its weight, is shaded in place of all of them.
Front march_ray(Ray ray, float t_end, uint weighs) {
    Front front = Front(vec3(0.0), vec3(0.0), 1.0);
    Search search = begin_search(ray, 0.0, NOTHING, 0u);
    float t = 0.0;
    Crossing put_off = NO_CROSSING;
    float weight_put_off = 0.0;
    LOOP {
        Crossing crossing = NO_CROSSING;
        if (surface_count > 0u) {
            crossing = find_crossing(ray, t_end, search);
        }
        bool hits = crossing.surface >= 0;
        uint side = side_of_surfaces(crossing.inside);
        march_segment(ray, t, hits ? crossing.t : t_end, side, weighs, front);
        // What the medium hides is not shaded, and needs no light.
        hits = hits && front.transmittance > OPAQUE_BELOW;
        float weight = hits ? front.transmittance * surface_at(uint(crossing.surface)).opacity : 0.0;
        front.transmittance -= weight;
        bool is_last = !hits || front.transmittance <= OPAQUE_BELOW;
        Crossing shaded = crossing;
        if (weight_put_off > 0.0 || !has_time_for_suns()) {
            weight_put_off += weight;
            bool is_picked = number_at(crossing.t) * weight_put_off < weight;
            put_off = is_picked ? crossing : put_off;
            shaded = put_off;
            weight = is_last ? weight_put_off : 0.0;
        }
        if (weight > 0.0) {
            front.radiance += weight * shade(ray, shaded, weighs);
        }
        if (is_last) {
            break;
        }
        t = crossing.t;
        pass_through(ray, crossing, search);
    }
    return front;
}

void main() {
    ivec2 pixel = own_pixel(rays().y);
    if (any(greaterThanEqual(pixel, ivec2(rays())))) {
        return;
    }
    uint index = index_of_texel(pixel);
    if (!begins_pixel(index)) {
        return;
    }
    step_scale = push.step_scale;
    float entry, t_end;
    Ray ray = camera_ray((vec2(pixel) + push.point) * float(push.stride), entry, t_end);
    Front front;
    // Weights are added up while the ray is marched, and cannot be taken back: where bricks of the volume may be
    // missing, they are added in a second march, once all that the ray meets is known to be there.
    uint marches = is_in_bricks && push.weighs != 0u ? 2u : 1u;
    for (uint n = 0u; n < marches && !is_void; ++n) {
        front = march_ray(ray, t_end, n + 1u == marches ? push.weighs : 0u);
    }
    if (!ends_pixel(index)) {
        return;
    }
    count_lookups();
    front.radiance += front.transmittance * background(ray.direction);
    vec4 result = vec4(front.radiance, 1.0 - front.transmittance);
    if (push.wanted != MARCH_PICTURE) {
        result = vec4(front.from_cache, channel_mean(front.radiance));
    }
    if (push.rays_before > 0u) {
        result = mix(imageLoad(unit_sum, pixel), result, 1.0 / float(push.rays_before + 1u));
    }
    imageStore(unit_sum, pixel, result);
}
