// The work of a batch, in portions (src/render/cache/work_list.rs): a list of turns. A turn is a part of the paths of
// each node of a brick. Bricks that are filled on the coarse lattice come first. An *item* is a part of one node's
// paths: items are what slots take from their queue, and each has room for its sums.

#include "scene.glsl"
#include "bricks.glsl"
#include "push.glsl"

layout(scalar) readonly buffer TurnBlock { Turn at[]; } turns;
// The sums of items, number by number: light, and as many columns of flux as the cache holds.
layout(scalar) buffer PartBlock { float at[]; } parts;

// Where the numbers of an item begin.
uint sums_at(uint item) {
    return item * (LIGHT_FLOATS + FLUX_FLOATS * flux_columns);
}

void store_sums(uint item, NodeSums sums) {
    uint at = sums_at(item);
    for (uint i = 0u; i < LIGHT_FLOATS; ++i) {
        parts.at[at + i] = sums.light[i];
    }
    for (uint i = 0u; i < FLUX_FLOATS * flux_columns; ++i) {
        parts.at[at + LIGHT_FLOATS + i] = sums.flux[i / FLUX_FLOATS][i % FLUX_FLOATS];
    }
}

void add_sums(uint item, inout NodeSums sums) {
    uint at = sums_at(item);
    for (uint i = 0u; i < LIGHT_FLOATS; ++i) {
        sums.light[i] += parts.at[at + i];
    }
    for (uint i = 0u; i < FLUX_FLOATS * flux_columns; ++i) {
        sums.flux[i / FLUX_FLOATS][i % FLUX_FLOATS] += parts.at[at + LIGHT_FLOATS + i];
    }
}

// Nodes of a brick on the fine lattice that get paths.
uint fine_nodes() {
    return push.nodes_half == BOTH_HALVES ? NODES : NODES / 2u;
}

uint nodes_of(uint turn) {
    return turn < push.coarse_turns ? COARSE_NODES : fine_nodes();
}

// The item of the first node of a turn; those of its other nodes follow.
uint first_item_of(uint turn) {
    uint coarse_turns = min(turn, push.coarse_turns);
    return COARSE_NODES * coarse_turns + fine_nodes() * (turn - coarse_turns);
}

uint turn_of(uint item) {
    uint coarse_items = COARSE_NODES * push.coarse_turns;
    return item < coarse_items ? item / COARSE_NODES : push.coarse_turns + (item - coarse_items) / fine_nodes();
}

// The node of an index in a box of so many nodes along each axis, x fastest, from its lowest one.
ivec3 offset_in(ivec3 size, uint index) {
    int i = int(index);
    return ivec3(i % size.x, i / size.x % size.y, i / (size.x * size.y));
}

// A node of the brick of a turn; `index` counts those that get paths. All nodes of the coarse lattice are in the first
// half.
ivec3 node_at(uint turn, uint place, uint index) {
    ivec3 low = BRICK * unpacked(bricks.at[place].position);
    if (turn < push.coarse_turns) {
        return low + 2 * offset_in(ivec3(BRICK / 2), index);
    }
    if (push.nodes_half == BOTH_HALVES) {
        return low + offset_in(ivec3(BRICK), index);
    }
    ivec3 offset = offset_in(ivec3(BRICK / 2, BRICK, BRICK), index);
    offset.x = 2 * offset.x + (offset.y + offset.z + int(push.nodes_half) & 1);
    return low + offset;
}
