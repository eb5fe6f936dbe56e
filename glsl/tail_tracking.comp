// Paths for the light that a march of the picture at rest (camera_march.comp) leaves to them: the light of surfaces
// without the suns' own, and that of the medium where the cache's nodes do not tell it. A path begins there, and ends where
// it may read the cache.

#version 460
#include "scene.glsl"
#include "bundle.glsl"
#include "cached_flight.glsl"
#include "camera.glsl"
#include "camera_ray.glsl"
#include "light.glsl"
#include "loop.glsl"
#include "path.glsl"
#include "pixel_paths.glsl"
#include "push.glsl"
#include "random.glsl"
#include "ray.glsl"
#include "surface.glsl"
#include "tails.glsl"

layout(scalar) readonly buffer TailBlock { Tail at[]; } tails;
layout(rgba32f) uniform image2D unit_sum;

// Paths for the light of a surface that fills a pixel. With more of them, where surfaces fill the picture, paths would take
// longer than the march before them.
const uint PATHS = 4u;

void add_coverage(inout Path path, float share) {}

void escape(inout Path path) {
    path.sum.rgb += path.throughput * escaping_radiance(path.direction, path.pdf);
}

Tail tail_of(uint item) {
    return tails.at[texel_index(item)];
}

// Whether the march has added the suns' light on the surface where the path begins; it says so in the tail's payload.
bool has_suns_already(Path path) {
    return path.bounces == 1u && path.surface >= 0 && tail_of(item_of(path)).payload.y == 0u;
}

// The sample that was marched.
uint sample_of(uint item) {
    return push.sample_index + item % units_together();
}

// Number of paths for a tail: fewer where its weight, which rounding may make greater than 1, is small.
uint paths_of(Tail tail) {
    return min(uint(ceil(tail.weight * float(PATHS))), PATHS);
}

bool begin_item(inout Path path) {
    // Where tails are rare, finding one could take more iterations than lavapipe allows (LAVAPIPE_ITERATIONS).
    const uint MOST = 32u;
    uint tried = 0u;
    uint item;
    bool more;
    LOOP {
        more = take_item(path, item);
        path.samples_left = more ? paths_of(tail_of(item)) : 0u;
        ++tried;
        if (!more || path.samples_left > 0u || tried == MOST) {
            break;
        }
        path.item = 0u;
    }
    if (!more) {
        return false;
    }
    path.pixel = pixel_at(item / units_together());
    path.sample_index = TAIL_SAMPLES + sample_of(item) * PATHS - 1u;
    path.sum = vec4(0.0);
    return true;
}

void begin_sample(inout Path path) {
    --path.samples_left;
    ++path.sample_index;
    begin_path(path);
    uint item = item_of(path);
    Random march = Random(path.pixel, sample_of(item), 0u);
    vec2 corner = vec2(texel_at_index(path.pixel));
    float entry, t_end;
    Ray ray = camera_ray(corner + marched_point(march), entry, t_end);
    Tail tail = tail_of(item);
    path.origin = ray.origin;
    path.direction = ray.direction;
    path.t = tail.t;
    path.t_end = tail.t;
    path.surface = tail.surface;
    path.inside = tail.surface == COLLISION ? 0u : tail.payload.x;
    if (tail.surface == COLLISION) {
        path.throughput = has_one_color ? scene.color : unpacked_albedo(tail.payload);
    }
    path.stage = STAGE_ARRIVAL;
    Random random = random_of(path);
    scatter(path, random);
    path.dimension = random.dimension;
}

void finish_pixel(Path path) {
    ivec2 at = texel_of(item_of(path));
    Tail tail = tail_of(item_of(path));
    vec4 marched = imageLoad(unit_sum, at);
    imageStore(unit_sum, at, marched + tail.weight / float(paths_of(tail)) * path.sum);
}
