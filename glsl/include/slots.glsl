// The paths that slots keep from dispatch to dispatch. A slot rests between the last path of an item and the next item:
// of its path nothing matters, and most of it is neither read nor written, since that would take a GPU longer than a
// short queue's paths.

#include "scene.glsl"
#include "loop.glsl"

layout(scalar) buffer PathBlock { Path at[]; } paths;

bool rests(Path path) {
    return path.stage == STAGE_IDLE && path.samples_left == 0u && path.item == 0u;
}

Path path_of(uint slot) {
    Path path;
    path.stage = paths.at[slot].stage;
    path.samples_left = paths.at[slot].samples_left;
    path.item = paths.at[slot].item;
    if (!rests(path)) {
        path = paths.at[slot];
    }
    return path;
}

void keep(uint slot, Path path) {
    if (rests(path)) {
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
