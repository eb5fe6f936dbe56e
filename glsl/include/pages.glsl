// Where the cache's nodes and cubes are in memory. Nodes come in bricks of BRICK³; only those that some ray can read
// have a place in the images, found through the page table.

#include "scene.glsl"

LOADED_AS(r32ui) uniform utexels3D pages;

uint page_of(ivec3 brick) {
    return texel_at(pages, brick).x;
}

bool has_memory(ivec3 node) {
    return page_of(node / BRICK) != NO_PLACE;
}

// Position of a node's texel in the images.
ivec3 node_texel(ivec3 node) {
    return BRICK * unpacked(page_of(node / BRICK)) + node % BRICK;
}

// Index of a brick's place, counted along the images' x, y and z.
uint place_of(ivec3 brick) {
    uvec3 at = uvec3(unpacked(page_of(brick)));
    return (at.z * scene.cache_places.y + at.y) * scene.cache_places.x + at.x;
}

// Where a node or a cube is among those of its brick.
uint index_in_brick(ivec3 node) {
    uvec3 inner = uvec3(node % BRICK);
    return (inner.z * BRICK + inner.y) * BRICK + inner.x;
}

// The word and the bit of a cube, where each brick has a number of words that begin with a bit for each cube.
uvec2 bit_of(ivec3 cube, uint words) {
    uint bit = index_in_brick(cube);
    return uvec2(words * place_of(cube / BRICK) + bit / 32u, bit % 32u);
}

// The word and the lower bit of a node's side (cache.glsl): sides stand behind the bits of the brick's cubes.
uvec2 side_bits_of(ivec3 node) {
    uint bit = 2u * index_in_brick(node);
    return uvec2(CUT_WORDS * place_of(node / BRICK) + RIM_WORDS + bit / 32u, bit % 32u);
}
