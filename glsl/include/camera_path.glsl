// Paths from the camera.

#include "scene.glsl"
#include "bundle.glsl"
#include "camera.glsl"
#include "camera_ray.glsl"
#include "light.glsl"
#include "path.glsl"
#include "path_search.glsl"
#include "pixel_paths.glsl"
#include "push.glsl"
#include "random.glsl"
#include "ray.glsl"
#include "surface.glsl"

layout(rgba32f) writeonly uniform image2D unit_sum;

void add_coverage(inout Path path, float share) {
    path.sum.a += share;
}

void escape(inout Path path) {
    vec3 radiance = path.bounces == 0u ? background(path.direction)
                                       : escaping_radiance(path.direction, path.pdf);
    path.sum.rgb += path.throughput * radiance;
}

bool has_suns_already(Path path) {
    return false;
}

bool begin_item(inout Path path) {
    uint item;
    if (!take_item(path, item)) {
        return false;
    }
    path.pixel = pixel_at(item / units_together());
    path.samples_left = push.samples;
    path.sample_index = push.first_sample + item % units_together() * push.samples - 1u;
    path.sum = vec4(0.0);
    return true;
}

void begin_sample(inout Path path) {
    --path.samples_left;
    ++path.sample_index;
    begin_path(path);
    Random random = random_of(path);
    vec2 jitter = point_in_pixel(numbers_for_direction(path, random).xy);
    vec2 corner = vec2(texel_at_index(path.pixel));
    float entry, t_end;
    Ray ray = camera_ray(corner + jitter, entry, t_end);
    path.origin = ray.origin;
    begin_flight(path, ray, 0.0, t_end);
    if (surface_count > 0u && path.t_end > 0.0) {
        find_surface(path, ray, NOTHING, random);
    }
    path.dimension = random.dimension;
}

void finish_pixel(Path path) {
    imageStore(unit_sum, texel_of(item_of(path)), path.sum);
}
