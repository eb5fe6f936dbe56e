// Tails: what a march of the picture at rest leaves to paths.

#include "scene.glsl"

// Whether the march may leave light to paths (`Features::has_tails`).
bool has_tails() {
    return surface_count > 0u || has_rim_cubes;
}

// The albedo of the medium where a tail begins, in the words of `Tail.payload`.

uvec2 packed_albedo(vec3 albedo) {
    return uvec2(packUnorm2x16(albedo.rg), packUnorm2x16(albedo.bb));
}

vec3 unpacked_albedo(uvec2 words) {
    return vec3(unpackUnorm2x16(words.x), unpackUnorm2x16(words.y).x);
}
