// Tails are what a march of the picture at rest leaves to paths. This packs the albedo of the medium where a tail begins into
// the words of `Tail.payload`.

uvec2 packed_albedo(vec3 albedo) {
    return uvec2(packUnorm2x16(albedo.rg), packUnorm2x16(albedo.bb));
}

vec3 unpacked_albedo(uvec2 words) {
    return vec3(unpackUnorm2x16(words.x), unpackUnorm2x16(words.y).x);
}
