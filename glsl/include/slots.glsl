// The paths that slots keep from dispatch to dispatch. A slot without an item is idle: the contents of its path are
// meaningless, and most of them are neither read nor written, which on a GPU would take longer than the paths of a short
// queue.

#include "scene.glsl"
#include "loop.glsl"

layout(scalar) buffer PathBlock { Path at[]; } paths;

bool is_idle(Path path) {
    return path.stage == STAGE_IDLE && path.samples_left == 0u && path.item == 0u;
}

Path load_path(uint slot) {
    Path path;
    path.stage = paths.at[slot].stage;
    path.samples_left = paths.at[slot].samples_left;
    path.item = paths.at[slot].item;
    if (!is_idle(path)) {
        path = paths.at[slot];
    }
    return path;
}

void store_path(uint slot, Path path) {
    if (is_idle(path)) {
        paths.at[slot].stage = path.stage;
        paths.at[slot].samples_left = path.samples_left;
        paths.at[slot].item = path.item;
        paths.at[slot].missing = path.missing;
    } else {
        paths.at[slot] = path;
    }
}

// Whether this thread's part of the dispatch is done. Threads that run together stop together, with the first that has
// iterated so often: one that stopped alone would idle until the others have stopped as well.
bool has_done_enough(uint most_iterations) {
#ifdef VOTES
    return subgroupAny(iterations >= most_iterations);
#else
    return iterations >= most_iterations;
#endif
}
