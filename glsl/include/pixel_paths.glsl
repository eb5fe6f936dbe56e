// Paths whose light belongs to pixels, pixel by pixel. A pixel's paths are summed by one slot in a fixed order: the picture
// does not depend on the number of slots.
//
// A shader that includes this defines the function that is declared below, besides `begin_item` and `begin_sample`
// (slot_loop.glsl).

#include "scene.glsl"
#include "bundle.glsl"
#include "slot_loop.glsl"

// Is called when all of the pixel's paths have ended.
void finish_pixel(Path path);

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
    return next_item(item_count(), item);
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

void load_item(uint slot, Path path) {}
void store_item(uint slot, Path path) {}
void hold_item() {}
void undo_item() {}
