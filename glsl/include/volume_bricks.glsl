// Access to voxels. A volume that fits is one image. A larger one is cut into bricks, of which one or several images hold as
// many as there is room for (src/render/bricks).
//
// An invocation that reads a voxel of a missing brick asks for that brick and reads another voxel instead. Everything
// that it computes from then on is void: it is discarded, and computed again, with the same random numbers, in a
// later dispatch. So a picture does not depend on which bricks are there, to the last bit. Only a preview keeps the
// result: the picture of a camera that moves, which is soon replaced.

#include "scene.glsl"
#include "bundle.glsl"

// Where the brick of a voxel is: the number of its image, and the offset from its voxels to their texels there.
struct BrickPlace {
    int image;
    ivec3 to_texel;
};

#ifdef VOLUME_IN_BRICKS

// A page for each brick. With PAGE_RESIDENT: its place in the images, ten bits an axis, and whether it has been read
// since the host last looked. Otherwise: the number of requests for it.
layout(scalar) buffer VolumePageBlock { uint at[]; } volume_pages;
// For each pixel or each brick of the cache, the mark of the work in which it was last done.
layout(scalar) buffer DoneBlock { uint at[]; } done;

// Whether a brick was missing; and the first missing one, counted from 1.
bool is_void = false;
uint first_missing = 0u;

bool asks_ahead = false;

// Lets an invocation ask for bricks even when it is void. A march mostly knows where it will read next, and may ask
// for all of that at once. A path does not. Neither does an invocation that works alone, because there is little
// room: its reads before it is void are what it needs, and its reads afterwards may be guided by wrong values.
void ask_ahead() {
    asks_ahead = streaming.now.count > 1u;
}

// Whether the current read is needed, as far as is known.
bool is_needed() {
    return asks_ahead || !is_void;
}

// Counts another request for a brick whose page shows `requests` so far. The count stops growing near 2²⁰, so that it cannot
// reach the flag bits of a page.
void request(uint brick, uint requests) {
    const uint MOST = 1u << 20;
    if (requests < MOST) {
        atomicAdd(volume_pages.at[brick], 1u);
    }
}

void ask_for(uint brick, uint requests) {
    bool is_preview = streaming.now.previews != 0u;
    if (is_preview || is_needed()) {
        request(brick, requests);
    }
    if (is_preview) {
        return;
    }
    first_missing = is_void ? first_missing : brick + 1u;
    is_void = true;
}

BrickPlace place_of_brick(ivec3 voxel) {
    ivec3 position = voxel >> scene.brick_shift;
    uint brick = (position.z * scene.volume_bricks.y + position.y) * scene.volume_bricks.x + position.x;
    uint page = volume_pages.at[brick];
    if ((page & PAGE_RESIDENT) == 0u) {
        ask_for(brick, page);
        page = 0u;
    } else if ((page & PAGE_READ) == 0u && is_needed()) {
        atomicOr(volume_pages.at[brick], PAGE_READ);
    }
    ivec3 place = unpacked(page);
    int image = place.z / PLACES_DEEP;
    place.z -= image * PLACES_DEEP;
    // Bricks hold the first voxels behind them as well: a trilinear cell lies in one of them.
    int side = 1 << scene.brick_shift;
    return BrickPlace(image, place * (side + 1) - position * side);
}

// To be called once every result that used a missing voxel has been undone.
void clear_void() {
    is_void = false;
}

// Whether a brick that an invocation has missed, counted from 1, is still missing. It is then asked for again.
bool still_misses(uint missing) {
    if (missing == 0u) {
        return false;
    }
    uint page = volume_pages.at[missing - 1u];
    if ((page & PAGE_RESIDENT) != 0u) {
        return false;
    }
    request(missing - 1u, page);
    return true;
}

// Whether an invocation has to let others work first.
bool is_not_admitted(uint index) {
    return index - streaming.now.first >= streaming.now.count;
}

bool is_done(uint index) {
    return done.at[index] == streaming.now.done_mark;
}

void set_done(uint index) {
    done.at[index] = streaming.now.done_mark;
}

// Reports the result of an invocation in this dispatch.
void report(uint index, bool has_missed, bool has_advanced) {
    if (has_missed) {
        atomicAdd(streaming.now.missed, 1u);
        atomicMin(streaming.now.first_missed, index);
    }
    if (has_advanced) {
        atomicAdd(streaming.now.advanced, 1u);
    }
}

// Whether an invocation that computes one pixel has that to do now. It may ask for bricks ahead.
bool begins_pixel(uint index) {
    if (is_not_admitted(index) || is_done(index)) {
        return false;
    }
    ask_ahead();
    return true;
}

// Whether its result may be stored: no brick was missing.
bool ends_pixel(uint index) {
    report(index, is_void, !is_void);
    if (!is_void) {
        set_done(index);
    }
    return !is_void;
}

#else

const bool is_void = false;
const uint first_missing = 0u;

void ask_ahead() {}

void clear_void() {}

bool still_misses(uint missing) {
    return false;
}

BrickPlace place_of_brick(ivec3 voxel) {
    return BrickPlace(0, ivec3(0));
}

bool is_not_admitted(uint index) {
    return false;
}

bool is_done(uint index) {
    return false;
}

void set_done(uint index) {}

void report(uint index, bool has_missed, bool has_advanced) {}

bool begins_pixel(uint index) {
    return true;
}

bool ends_pixel(uint index) {
    return true;
}

#endif
