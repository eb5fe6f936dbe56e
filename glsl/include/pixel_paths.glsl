// Paths whose light belongs to pixels, pixel by pixel. A pixel's paths are summed by one slot in a fixed order: the picture
// does not depend on the number of slots.
//
// A shader that includes this takes push constants `work` and `slots`, and defines:

// Takes a pixel, which may have no paths, from the queue. Returns false if the queue is empty.
bool begin_pixel(inout Path path);
// Is called when all of the pixel's paths have ended.
void finish_pixel(Path path);

#include "slot_loop.glsl"

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

bool begin_item(inout Path path) {
    return begin_pixel(path);
}

void finish_item(inout Path path) {
    finish_pixel(path);
    path.item = 0u;
}

void load_work(uint slot, Path path) {}
void store_work(uint slot, Path path) {}
void hold_work() {}
void undo_work() {}
