// Counter-based random numbers: pcg4d of Jarzynski and Olano, "Hash Functions for GPU Rendering"
// (JCGT 2020). The hash is a bijection of (pixel, sample, dimension, seed), so no two of them ever
// share a number's origin: streams cannot overlap.

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

// In [0, 1): 24 bits, so that 1 is never reached.
float unit_interval(uint word) {
    return float(word >> 8u) * exp2(-24.0);
}

vec4 random_numbers(inout Random random) {
    uvec4 words = random_words(random);
    return vec4(unit_interval(words.x), unit_interval(words.y), unit_interval(words.z),
                unit_interval(words.w));
}

// The index-th of points that fill the unit square evenly, for any number of them: Roberts' R2 sequence
// (an additive recurrence), moved by `rotation`. Each alone is uniform if the rotation is, so that
// nothing is biased. In fixed point: a float's fraction would lose digits with the index.
vec2 even_point(uvec2 rotation, uint index) {
    uvec2 p = rotation + index * uvec2(3242174889u, 2447445413u);
    return vec2(unit_interval(p.x), unit_interval(p.y));
}

// −ln(1 − u) for the 32-bit u = (word + ½)·2⁻³². Small u go through the series, since 1 − u would
// lose their digits; large ones through the complement, so that the tail reaches 22.9.
float exponential(uint word) {
    bool small = word < 0x01000000u;
    float u = (float(word) + 0.5) * exp2(-32.0);
    float complement = (float(~word) + 0.5) * exp2(-32.0);
    return small ? u * (1.0 + u * (0.5 + u * (1.0 / 3.0))) : -log(complement);
}
