// In which order pixels get their samples, and where the sums of units wait until they are folded into the picture.
//
// Where the volume streams, several units are worked off together, pixel by pixel (src/render/bundle.rs). An *item* is
// a unit of a pixel. All items of a pixel follow one another, then those of the next pixel, strip by strip through the
// picture and back and forth in each: what is under way at the same time needs the same bricks. The sums have
// no more room than those of a single unit of all pixels: items use it in turn.
//
// Otherwise there is one unit, and an item is a pixel.

#ifdef VOLUME_IN_BRICKS

layout(scalar) buffer StreamingBlock { Streaming now; } streaming;

uint units_together() {
    return streaming.now.units;
}

uint first_item() {
    return streaming.now.first_item;
}

// The pixel that comes at this place in the order of work.
uint pixel_at(uint place) {
    uint strip = place / (STRIP_HEIGHT * scene.size.x);
    uint height = min(STRIP_HEIGHT, scene.size.y - strip * STRIP_HEIGHT);
    uint inner = place - strip * STRIP_HEIGHT * scene.size.x;
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

uint pixel_at(uint place) {
    return place;
}

#endif

uint item_count() {
    return scene.size.x * scene.size.y * units_together();
}

// Items whose sums have room at once.
uint items_at_once() {
    uint texels = scene.size.x * scene.size.y;
    return texels - texels % units_together();
}

// Where an item's sum is.
uint texel_index(uint item) {
    return is_in_bricks ? item % items_at_once() : item;
}

ivec2 texel_at_index(uint index) {
    return ivec2(index % scene.size.x, index / scene.size.x);
}

ivec2 texel_of(uint item) {
    return texel_at_index(texel_index(item));
}
