// Sets a bit for some of the cache's cubes; all bits are zero before. A workgroup handles a brick, a thread a cube. A
// shader that includes this file decides which bits are set: it defines `may_mark` and `marks_of`, and, before the include,
// WORDS_A_BRICK. It can also compute a value for each node in `examine`; `store_examined` stores it once no brick of the volume
// is missing.

#include "scene.glsl"
#include "bricks.glsl"
#include "counters.glsl"
#include "nodes.glsl"
#include "pages.glsl"
#include "push.glsl"
#include "ranges.glsl"
#include "volume.glsl"
#include "volume_bricks.glsl"

layout(local_size_x = BRICK, local_size_y = BRICK, local_size_z = BRICK) in;
layout(scalar) buffer BitBlock { uint at[]; } bits;

// Threads of the group that have missed a brick of the volume.
shared uint lacking;
// Whether some cube of the brick may set a bit.
shared bool is_possible;

const uint NOTHING_MARKED = 0u;
const uint CUBE_MARKED = 1u;
const uint NEIGHBOURS_MARKED = 2u;   // and the cube itself
const uint SURROUNDINGS_MARKED = 3u; // as far as `mark_reach` says

// Space in the lattice, in grid space: from node to node, or out to the box's faces.
struct Span {
    vec3 low, high;
    bvec3 begins, ends; // at a face, across each axis
};

// The cubes from `first` to `last`.
Span span_of(ivec3 first, ivec3 last) {
    bvec3 begins = equal(first, ivec3(0));
    bvec3 ends = greaterThanEqual(last + 2, ivec3(scene.cache_nodes));
    return Span(mix(node_position(first), vec3(0.5), begins),
                mix(node_position(last + 1), vec3(scene.dims) + 0.5, ends), begins, ends);
}

vec2 range_of_macrocells(Span span) {
    ivec3 last = ivec3(scene.macrocells) - 1;
    return range_between(min(ivec3(span.low) / MACROCELL, last), min(ivec3(span.high) / MACROCELL, last));
}

bool may_mark(Span span);
uint marks_of(ivec3 cube);
// `is_possible`: some cube of the node's brick may set a bit.
void examine(ivec3 node, bool is_possible);
void store_examined(ivec3 node);

void set_bits(uint word, uint mask) {
    // Cubes that many others mark are set already: a GPU's threads would wait for each other at the counter.
    if ((~bits.at[word] & mask) == 0u) {
        return;
    }
    uint before = atomicOr(bits.at[word], mask);
    atomicAdd(counters.count.marked_cubes, uint(bitCount(~before & mask)));
}

void set_bit(ivec3 cube) {
    uvec2 bit = bit_of(cube, WORDS_A_BRICK);
    set_bits(bit.x, 1u << bit.y);
}

// Sets the bits of a brick's cubes from `low` to `high`.
void set_bits_in(ivec3 brick, ivec3 low, ivec3 high) {
    ivec3 first = BRICK * brick;
    low = max(low - first, ivec3(0));
    high = min(high - first, ivec3(BRICK - 1));
    uint words[RIM_WORDS];
    for (uint w = 0u; w < RIM_WORDS; ++w) {
        words[w] = 0u;
    }
    uint row = (1u << (high.x - low.x + 1)) - 1u;
    for (int z = low.z; z <= high.z; ++z) {
        for (int y = low.y; y <= high.y; ++y) {
            uint bit = index_in_brick(ivec3(low.x, y, z));
            words[bit / 32u] |= row << bit % 32u;
        }
    }
    for (uint w = 0u; w < RIM_WORDS; ++w) {
        if (words[w] != 0u) {
            set_bits(WORDS_A_BRICK * place_of(brick) + w, words[w]);
        }
    }
}

// How far marks reach from a cube along each axis, in cubes: as far as the longest side of a voxel. Where slices are far
// apart, as in many CTs, a wall may shift sideways by about that distance from one slice to the next, and with it the steep
// fall of light behind the wall.
ivec3 mark_reach() {
    const int MOST = 8;
    const float LITTLE = 0.1; // of a cube, for which no further one is marked
    float longest = max(scene.spacing.x, max(scene.spacing.y, scene.spacing.z));
    return clamp(ivec3(ceil(longest / (scene.cache_step * scene.spacing) - LITTLE)), ivec3(1), ivec3(MOST));
}

void set_bits_around(ivec3 cube, ivec3 reach) {
    ivec3 low = max(cube - reach, ivec3(0));
    ivec3 high = min(cube + reach, last_cube());
    for (int z = low.z / BRICK; z <= high.z / BRICK; ++z) {
        for (int y = low.y / BRICK; y <= high.y / BRICK; ++y) {
            for (int x = low.x / BRICK; x <= high.x / BRICK; ++x) {
                if (page_of(ivec3(x, y, z)) != NO_PLACE) {
                    set_bits_in(ivec3(x, y, z), low, high);
                }
            }
        }
    }
}

// The voxels whose cells meet a cube, out to the box's faces.
struct Voxels {
    ivec3 low, high;
};

Voxels voxels_of(ivec3 cube) {
    ivec3 last = ivec3(scene.dims) - 1;
    ivec3 low = clamp(ivec3(floor(node_position(cube))) - 1, ivec3(0), last);
    ivec3 high = clamp(ivec3(ceil(node_position(cube + 1))) - 1, ivec3(0), last);
    return Voxels(mix(low, ivec3(0), equal(cube, ivec3(0))),
                  mix(high, last, greaterThanEqual(cube + 2, ivec3(scene.cache_nodes))));
}

vec2 range_of_voxels(Voxels voxels) {
    vec2 range = vec2(LARGEST, -LARGEST);
    for (int z = voxels.low.z; z <= voxels.high.z; ++z) {
        for (int y = voxels.low.y; y <= voxels.high.y; ++y) {
            for (int x = voxels.low.x; x <= voxels.high.x; ++x) {
                float v = volume_voxel(ivec3(x, y, z));
                range = vec2(min(range.x, v), max(range.y, v));
            }
        }
    }
    return range;
}

void main() {
    uint place = gl_WorkGroupID.y * push.row + gl_WorkGroupID.x;
    if (place >= push.bricks || is_not_admitted(place) || is_done(place)) {
        return;
    }
    ask_ahead();
    uint thread = gl_LocalInvocationIndex;
    ivec3 first = BRICK * unpacked(bricks.at[place].position);
    if (thread == 0u) {
        lacking = 0u;
        is_possible = may_mark(span_of(first, first + BRICK - 1));
    }
    barrier();
    ivec3 cube = first + ivec3(gl_LocalInvocationID);
    bool exists = all(lessThanEqual(cube, last_cube()));
    uint marks = is_possible && exists ? marks_of(cube) : NOTHING_MARKED;
    bool is_node = is_in_lattice(cube);
    if (is_node) {
        examine(cube, is_possible);
    }
    if (is_void) {
        atomicAdd(lacking, 1u);
    }
    barrier();
    bool has_missed = lacking > 0u;
    if (thread == 0u) {
        report(place, has_missed, !has_missed);
        if (!has_missed) {
            set_done(place);
        }
    }
    if (!has_missed && is_node) {
        store_examined(cube);
    }
    if (!has_missed && marks == CUBE_MARKED) {
        set_bit(cube);
    }
    if (!has_missed && marks >= NEIGHBOURS_MARKED) {
        set_bits_around(cube, marks == NEIGHBOURS_MARKED ? ivec3(1) : mark_reach());
    }
}
