// Counter-based random numbers: pcg4d of Jarzynski and Olano, "Hash Functions for GPU Rendering"
// (JCGT 2020). The hash is a bijection of (pixel, sample, dimension, seed): two different inputs never give the same
// output, so streams cannot overlap. (Nodes of a cache count as pixels. In a lattice of more than 2³²,
// those that are 2³² apart have the same numbers.)

#include "scene.glsl"

struct Random {
    uint pixel;
    uint sample_index;
    uint dimension;
};

uvec4 random_words(inout Random random) {
    uvec4 v = uvec4(random.pixel, random.sample_index, random.dimension++, scene.seed);
    v = v * 1664525u + 1013904223u;
    v.x += v.y * v.w;
    v.y += v.z * v.x;
    v.z += v.x * v.y;
    v.w += v.y * v.z;
    v ^= v >> 16u;
    v.x += v.y * v.w;
    v.y += v.z * v.x;
    v.z += v.x * v.y;
    v.w += v.y * v.z;
    return v;
}

// A number in [0, 1) of 24 bits, so that 1 is never reached.
float unit_interval(uint word) {
    return float(word >> 8u) * exp2(-24.0);
}

vec4 unit_intervals(uvec4 words) {
    return vec4(unit_interval(words.x), unit_interval(words.y), unit_interval(words.z),
                unit_interval(words.w));
}

vec4 random_numbers(inout Random random) {
    return unit_intervals(random_words(random));
}

// Low-discrepancy points: of a pixel's samples, any aligned run of 2^k has exactly one point in each elementary box of area
// 2^−k. A path's start and its first event take their numbers from these points; where there are surfaces, they cause most
// of a picture's noise, and for later events such points gain nothing (measured).
//
// The first two dimensions of Sobol's sequence, padded: each pair has its own order of samples. Scrambling as Owen's
// (1995), by the hash of Laine and Karras (2011) with Vegdahl's constants; shuffling and padding as in Burley,
// "Practical Hash-based Owen Scrambling" (JCGT 2020).

// Indices of an event's pairs; event 0 is the path's start. Each event has two pairs for light and two for a direction.
uint light_pairs(uint event) { return 4u * event; }
uint direction_pairs(uint event) { return 4u * event + 2u; }

// Flips each bit by a hash of the bits below it.
uint scrambled_upwards(uint x, uint seed) {
    x ^= x * 0x3D20ADEAu;
    x += seed;
    x *= seed >> 16u | 1u;
    x ^= x * 0x05526C56u;
    x ^= x * 0x53A22864u;
    return x;
}

uvec2 sobol_pair(Random random, uint pair) {
    Random of_pair = Random(random.pixel, OF_ALL_SAMPLES, pair);
    // A hash's high bits are its best; scrambling begins with a seed's lowest.
    uvec4 seeds = bitfieldReverse(random_words(of_pair));
    uint index = bitfieldReverse(scrambled_upwards(bitfieldReverse(random.sample_index), seeds.x));
    // Sobol's second matrix is Pascal's triangle modulo 2: bit i of y is the parity of those bits j of the index for which j
    // has every binary digit that i has.
    uint y = index;
    y ^= y >> 16u;
    y ^= y >> 8u & 0x00FF00FFu;
    y ^= y >> 4u & 0x0F0F0F0Fu;
    y ^= y >> 2u & 0x33333333u;
    y ^= y >> 1u & 0x55555555u;
    return bitfieldReverse(uvec2(scrambled_upwards(index, seeds.y), scrambled_upwards(y, seeds.z)));
}

uvec4 sobol_words(Random random, uint pairs) {
    return uvec4(sobol_pair(random, pairs), sobol_pair(random, pairs + 1u));
}

// −ln(1 − u) for the 32-bit u = (word + ½)·2⁻³². Small u go through the series, since 1 − u would
// lose their digits; large ones through the complement, so that the tail reaches 22.9.
float exponential(uint word) {
    bool small = word < 0x01000000u;
    float u = (float(word) + 0.5) * exp2(-32.0);
    float complement = (float(~word) + 0.5) * exp2(-32.0);
    return small ? u * (1.0 + u * (0.5 + u * (1.0 / 3.0))) : -log(complement);
}
