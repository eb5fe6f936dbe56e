// Paths from the camera, pixel by pixel.
//
// Each slot takes a pixel from a queue, traces all of its samples one after another, and takes the
// next pixel, so that no lane idles because its neighbour's paths are longer. A slot does a
// bounded amount of work in a dispatch and keeps its path in memory until the next one. A pixel's samples
// are summed by one slot in a fixed order: the picture does not depend on the number of slots.

layout(local_size_x = 64) in;
layout(push_constant, scalar) uniform PushBlock { TrackPush push; };
layout(scalar) buffer PathBlock { Path at[]; } paths;
layout(scalar) buffer CounterBlock { Counters count; } counters;
layout(rgba32f) writeonly uniform image2D unit_sum;

void contribute(inout Path path, vec3 radiance) {
    path.sum.rgb += radiance;
}

void cover(inout Path path, float share) {
    path.sum.a += share;
}

void escape(inout Path path) {
    bool unscattered = path.bounces == 0u;
    vec3 radiance = escaping_radiance(path.direction, path.pdf);
    if (unscattered && background_is_color) {
        radiance = scene.background;
    }
    if (!unscattered || !background_is_transparent) {
        path.sum.rgb += path.throughput * radiance;
    }
}

bool begin_pixel(inout Path path) {
    uint pixel = atomicAdd(counters.count.next, 1u);
    if (pixel >= scene.size.x * scene.size.y) {
        return false;
    }
    path.pixel = pixel;
    path.samples_left = push.samples;
    path.sample_index = push.first_sample - 1u;
    path.sum = vec4(0.0);
    return true;
}

void begin_sample(inout Path path) {
    --path.samples_left;
    ++path.sample_index;
    begin_path(path);
    Random random = random_of(path);
    vec2 jitter = numbers_for_direction(path, random).xy;
    vec2 corner = vec2(path.pixel % scene.size.x, path.pixel / scene.size.x);
    float entry, t_end;
    Ray ray = camera_ray(corner + jitter, entry, t_end);
    path.origin = ray.origin;
    begin_flight(path, ray, 0.0, t_end);
    if (surface_count > 0u && path.t_end > 0.0) {
        find_surface(path, ray, NOTHING, true, random);
    }
    path.dimension = random.dimension;
}

void main() {
    uint slot = gl_GlobalInvocationID.x;
    if (slot >= push.slots) {
        return;
    }
    Path path = paths.at[slot];
    bool working = true;
    while (working && work < push.work) {
        ++work;
        if (path.stage == STAGE_IDLE) {
            working = path.samples_left > 0u || begin_pixel(path);
            if (working) {
                begin_sample(path);
            }
        }
        if (working) {
            advance(path);
            if (path.stage == STAGE_IDLE && path.samples_left == 0u) {
                ivec2 at = ivec2(path.pixel % scene.size.x, path.pixel / scene.size.x);
                imageStore(unit_sum, at, path.sum);
            }
        }
    }
    paths.at[slot] = path;
    if (working) {
        atomicAdd(counters.count.unfinished, 1u);
    }
    atomicAdd(counters.count.lookups, lookups);
}
