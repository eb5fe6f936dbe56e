// Paths whose light belongs to pixels, pixel by pixel.
//
// Each slot takes a pixel from a queue, traces all of its paths one after another, and takes the next pixel, so that no
// lane idles because its neighbour's paths are longer. A slot does a bounded amount of work in a dispatch and keeps
// its path in memory until the next one. A pixel's paths are summed by one slot in a fixed order: the picture does not
// depend on the number of slots.
//
// A shader that includes this has a PushBlock with `work` and `slots`, and defines:

// Takes a pixel, which may have no paths, from the queue. Returns false if the queue is empty.
bool begin_pixel(inout Path path);
// Begins the pixel's next path.
void begin_sample(inout Path path);
// Is called when all of the pixel's paths have ended.
void finish_pixel(Path path);

layout(local_size_x = 64) in;
layout(scalar) buffer PathBlock { Path at[]; } paths;
layout(scalar) buffer CounterBlock { Counters count; } counters;

void contribute(inout Path path, vec3 radiance) {
    path.sum.rgb += radiance;
}

void main() {
    uint slot = gl_GlobalInvocationID.x;
    if (slot >= push.slots || stands_back(slot)) {
        return;
    }
    Path path = paths.at[slot];
    bool working = true;
    bool has_advanced = false;
    while (working && !is_void && work < push.work) {
        ++work;
        if (path.stage == STAGE_IDLE && path.samples_left == 0u) {
            working = begin_pixel(path);
        }
        Path before = path;
        uint lookups_before = lookups;
        if (path.stage == STAGE_IDLE && path.samples_left > 0u) {
            begin_sample(path);
        }
        if (path.stage != STAGE_IDLE) {
            advance(path);
            if (is_void) {
                path = before;
                lookups = lookups_before;
            } else {
                has_advanced = true;
                if (path.stage == STAGE_IDLE && path.samples_left == 0u) {
                    finish_pixel(path);
                }
            }
        }
    }
    paths.at[slot] = path;
    if (working) {
        atomicAdd(counters.count.unfinished, 1u);
    }
    atomicAdd(counters.count.lookups, lookups);
    report(slot, is_void, has_advanced);
}
