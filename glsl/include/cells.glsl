// The lattice of the cache: nodes from face to face of the box, cells between them, bricks of BRICK³
// nodes. A cell or brick is named by its lowest node.

vec3 node_position(ivec3 node) {
    return 0.5 + vec3(node) * scene.cache_step;
}

// Three numbers of ten bits.
ivec3 unpacked(uint word) {
    return ivec3(word, word >> 10u, word >> 20u) & 1023;
}

// The cell that holds a point, and where in it.
struct CacheCell {
    ivec3 low;
    vec3 p;
};

CacheCell cache_cell(vec3 g) {
    vec3 c = clamp((g - 0.5) / scene.cache_step, vec3(0.0), vec3(scene.cache_nodes - 1u));
    CacheCell cell;
    cell.low = min(ivec3(c), ivec3(scene.cache_nodes) - 2);
    cell.p = c - vec3(cell.low);
    return cell;
}
