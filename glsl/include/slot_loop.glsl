// What a slot does in a dispatch.
//
// It takes an item from a queue, traces all of its paths one after another, and takes the next item, so that no lane idles
// because its neighbour's paths are longer. It does a bounded number of iterations, and keeps its path in memory until the next
// dispatch. A step that has missed a brick of the volume is undone, and is taken again once the brick is there.
//
// A shader that includes this takes push constants `most_iterations` and `slots`, and defines the functions that are declared below.

#include "scene.glsl"
#include "bundle.glsl"
#include "counters.glsl"
#include "loop.glsl"
#include "path.glsl"
#include "push.glsl"
#include "slots.glsl"
#include "tracking.glsl"
#include "volume_bricks.glsl"

// Takes an item, which may have no paths, from the queue. Returns false if there is none to work on.
bool begin_item(inout Path path);
// Begins the item's next path.
void begin_sample(inout Path path);
// Is called when all of the item's paths have ended.
void finish_item(inout Path path);
// What the shader knows of an item besides its path: fetches it from memory and stores it there, and holds it while a step is
// taken, which may have to be undone.
void load_item(uint slot, Path path);
void store_item(uint slot, Path path);
void hold_item();
void undo_item();

layout(local_size_x = 64) in;

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
    if (is_not_admitted(slot)) {
        report_item(paths.at[slot].item);
        return;
    }
    if (is_in_bricks && still_misses(paths.at[slot].missing)) {
        report_item(paths.at[slot].item);
        atomicAdd(counters.count.unfinished, 1u);
        report(slot, true, false);
        return;
    }
    Path path = load_path(slot);
    load_item(slot, path);
    uint finished = 0u;
    bool working = true;
    bool has_advanced = false;
    while (working && first_missing == 0u && !has_done_enough(push.most_iterations)) {
        ++iterations;
        if (path.stage == STAGE_IDLE && path.samples_left == 0u) {
            working = begin_item(path);
        }
        Path before = path;
        hold_item();
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
                undo_item();
                lookups = lookups_before;
            } else {
                has_advanced = true;
                if (path.stage == STAGE_IDLE) {
                    ++finished;
                    if (path.samples_left == 0u) {
                        finish_item(path);
                    }
                }
            }
        }
    }
    path.missing = first_missing;
    store_path(slot, path);
    store_item(slot, path);
    report_item(path.item);
    if (working) {
        atomicAdd(counters.count.unfinished, 1u);
    }
    if (lookups > 0u) {
        atomicAdd(counters.count.lookups, lookups);
    }
    if (finished > 0u) {
        atomicAdd(counters.count.finished, finished);
    }
    report(slot, first_missing != 0u, has_advanced);
}
