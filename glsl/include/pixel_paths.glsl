// Paths whose light belongs to pixels, pixel by pixel.
//
// Each slot takes a pixel from a queue, traces all of its paths one after another, and takes the next pixel, so that
// no lane idles because its neighbour's paths are longer. A slot does a bounded amount of work in a dispatch and
// keeps its path in memory until the next one. A pixel's paths are summed by one slot in a fixed order: the picture
// does not depend on the number of slots.
//
// A shader that includes this takes push constants `work` and `slots`, and defines:

// Takes a pixel, which may have no paths, from the queue. Returns false if the queue is empty.
bool begin_pixel(inout Path path);
// Begins the pixel's next path.
void begin_sample(inout Path path);
// Is called when all of the pixel's paths have ended.
void finish_pixel(Path path);

layout(local_size_x = 64) in;
layout(scalar) buffer CounterBlock { Counters count; } counters;
#include "slots.glsl"

void contribute(inout Path path, vec3 radiance) {
    path.sum.rgb += radiance;
}

// Takes the next item from the queue; false if the slot has to wait, or if there is no item left.
bool take_item(inout Path path, out uint item) {
#ifdef VOLUME_IN_BRICKS
    if (path.item == 0u) {
        path.item = 1u + streaming.now.first_item + atomicAdd(counters.count.next, 1u);
    }
    item = path.item - 1u;
    return item < streaming.now.end_item;
#else
    item = atomicAdd(counters.count.next, 1u);
    return item < item_count();
#endif
}

// The item that a slot works on.
uint item_of(Path path) {
#ifdef VOLUME_IN_BRICKS
    return path.item - 1u;
#else
    return path.pixel;
#endif
}

void finish_item(inout Path path) {
    finish_pixel(path);
    path.item = 0u;
}

// Reports the item that a slot still works on to the host.
void report_item(uint item) {
#ifdef VOLUME_IN_BRICKS
    if (item != 0u) {
        atomicMin(streaming.now.oldest_item, item - 1u);
    }
#endif
}

void main() {
    uint slot = gl_GlobalInvocationID.x;
    if (slot >= push.slots) {
        return;
    }
    if (stands_back(slot)) {
        report_item(paths.at[slot].item);
        return;
    }
    if (is_in_bricks && still_misses(paths.at[slot].missing)) {
        report_item(paths.at[slot].item);
        atomicAdd(counters.count.unfinished, 1u);
        report(slot, true, false);
        return;
    }
    Path path = path_of(slot);
    bool working = true;
    bool has_advanced = false;
    while (working && first_missing == 0u && !has_done_enough(push.work)) {
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
            if (!is_void) {
                advance(path);
            }
            if (is_void) {
                path = before;
                lookups = lookups_before;
            } else {
                has_advanced = true;
                if (path.stage == STAGE_IDLE && path.samples_left == 0u) {
                    finish_item(path);
                }
            }
        }
    }
    path.missing = first_missing;
    keep(slot, path);
    report_item(path.item);
    if (working) {
        atomicAdd(counters.count.unfinished, 1u);
    }
    atomicAdd(counters.count.lookups, lookups);
    report(slot, first_missing != 0u, has_advanced);
}
