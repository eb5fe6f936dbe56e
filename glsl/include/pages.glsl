// Where the cache's nodes and cubes are in memory. Nodes come in bricks of BRICK³; only those that some ray can read
// have a place in the images, found through the page table.

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

// The word and the bit of a cube among those of all bricks.
uvec2 bit_of(ivec3 cube) {
    uint bit = index_in_brick(cube);
    return uvec2(2u * place_of(cube / BRICK) + bit / 32u, bit % 32u);
}

// The word of a node's side (cache.glsl) among those of all bricks, and its lower bit.
uvec2 side_bits_of(ivec3 node) {
    uint bit = 2u * index_in_brick(node);
    return uvec2(4u * place_of(node / BRICK) + bit / 32u, bit % 32u);
}
