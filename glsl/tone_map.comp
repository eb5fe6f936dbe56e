// Conversion from linear radiance to display values, as in src/output/display.rs for the PNG.

#version 460
#extension GL_EXT_scalar_block_layout : require
#include "shared.glsl"

layout(local_size_x = 8, local_size_y = 8) in;
#include "push.glsl"
layout(rgba32f) readonly uniform image2D picture;
layout(rgba8) writeonly uniform image2D shown;

vec3 texel(ivec2 p) {
    return imageLoad(picture, clamp(p, ivec2(0), ivec2(push.source) - 1)).rgb;
}

// The picture at p, interpolated bilinearly.
vec3 stretched(vec2 p) {
    vec2 low = floor(p - 0.5);
    vec2 t = p - 0.5 - low;
    ivec2 i = ivec2(low);
    vec3 upper = mix(texel(i), texel(i + ivec2(1, 0)), t.x);
    vec3 lower = mix(texel(i + ivec2(0, 1)), texel(i + ivec2(1, 1)), t.x);
    return mix(upper, lower, t.y);
}

// As `filmic` in src/output/display.rs.
vec3 filmic(vec3 x) {
    x = clamp(x, 0.0, 1e6);
    return min((x * (2.51 * x + 0.03)) / (x * (2.43 * x + 0.59) + 0.14), 1.0);
}

vec3 encoded(vec3 linear) {
    vec3 curve = 1.055 * pow(linear, vec3(1.0 / 2.4)) - 0.055;
    return mix(curve, 12.92 * linear, lessThanEqual(linear, vec3(0.0031308)));
}

void main() {
    ivec2 pixel = ivec2(gl_GlobalInvocationID.xy);
    if (any(greaterThanEqual(pixel, ivec2(push.size)))) {
        return;
    }
    bool same = push.source == push.size;
    vec2 scale = vec2(push.source) / vec2(push.size);
    vec3 radiance = same ? texel(pixel) : stretched((vec2(pixel) + 0.5) * scale);
    vec3 exposed = push.exposure * max(radiance, vec3(0.0));
    vec3 toned = push.filmic != 0u ? filmic(exposed) : min(exposed, vec3(1.0));
    // To whole levels here: a device's own conversion may round to the other neighbour, or down.
    vec3 levels = min(round(255.0 * encoded(toned)) + 0.25, 255.0);
    imageStore(shown, pixel, vec4(levels / 255.0, 1.0));
}
