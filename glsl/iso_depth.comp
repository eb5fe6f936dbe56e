// The first surface that the ray through each pixel's centre meets: its distance, normal and colour. A surface
// without opacity does not count.

#version 460
#include "scene.glsl"
#include "camera.glsl"
#include "camera_ray.glsl"
#include "loop.glsl"
#include "ray.glsl"
#include "surface.glsl"
#include "volume_bricks.glsl"

layout(local_size_x = 8, local_size_y = 8) in;
layout(rgba32f) writeonly uniform image2D normal_depth;
layout(rgba32f) writeonly uniform image2D albedo;

void main() {
    ivec2 pixel = own_pixel(scene.size.y);
    if (any(greaterThanEqual(pixel, ivec2(scene.size)))) {
        return;
    }
    uint index = index_of_texel(pixel);
    if (!begins_pixel(index)) {
        return;
    }
    float entry, t_end;
    Ray ray = camera_ray(vec2(pixel) + 0.5, entry, t_end);
    Search search = begin_search(ray, 0.0, NOTHING, 0u);
    Crossing crossing;
    LOOP {
        crossing = find_crossing(ray, t_end, search);
        if (crossing.surface < 0 || surface_at(uint(crossing.surface)).opacity > 0.0) {
            break;
        }
        pass_through(ray, crossing, search);
    }
    vec4 normal = vec4(0.0, 0.0, 0.0, uintBitsToFloat(0x7f800000u));
    vec4 color = vec4(0.0);
    if (crossing.surface >= 0) {
        normal = vec4(hit_at(ray, crossing).shading_normal, entry + crossing.t);
        color = vec4(surface_at(uint(crossing.surface)).color, 1.0);
    }
    if (ends_pixel(index)) {
        imageStore(normal_depth, pixel, normal);
        imageStore(albedo, pixel, color);
    }
}
