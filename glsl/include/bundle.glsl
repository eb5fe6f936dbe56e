// The order in which pixels get their samples, and where the sums of units wait until they are folded into the
// picture.
//
// Where the volume streams, several units are worked off together, pixel by pixel (src/render/picture/bundle.rs). An *item*
// is a unit of a pixel. All items of a pixel follow one another, then those of the next pixel, strip by strip through
// the picture and back and forth in each strip: items under way at the same time need the same bricks. All sums share
// the memory of a single unit's sums: items use it in turn.
//
// Otherwise there is one unit, and an item is a pixel.

#include "scene.glsl"

#ifdef VOLUME_IN_BRICKS

layout(scalar) buffer StreamingBlock { Streaming now; } streaming;

uint units_together() {
    return streaming.now.units;
}

uint first_item() {
    return streaming.now.first_item;
}

// The pixel at a position in the order of work.
uint pixel_at(uint position) {
    uint strip = position / (STRIP_HEIGHT * scene.size.x);
    uint height = min(STRIP_HEIGHT, scene.size.y - strip * STRIP_HEIGHT);
    uint inner = position - strip * STRIP_HEIGHT * scene.size.x;
    uint x = inner / height;
    uint y = inner % height;
    y = (x & 1u) == 0u ? y : height - 1u - y;
    x = (strip & 1u) == 0u ? x : scene.size.x - 1u - x;
    return (strip * STRIP_HEIGHT + y) * scene.size.x + x;
}

#else

uint units_together() {
    return 1u;
}

uint first_item() {
    return 0u;
}

uint pixel_at(uint position) {
    return position;
}

#endif

uint item_count() {
    return scene.size.x * scene.size.y * units_together();
}

// Number of items whose sums have room at once.
uint items_at_once() {
    uint texels = scene.size.x * scene.size.y;
    return texels - texels % units_together();
}

// Index of an item's sum.
uint texel_index(uint item) {
    return is_in_bricks ? item % items_at_once() : item;
}

ivec2 texel_of(uint item) {
    return texel_at_index(texel_index(item));
}
