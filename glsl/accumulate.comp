// Folds a unit, every pixel's sum over the same number of samples, into each pixel's running mean
// and into the weighted sum of squared differences from it (West, CACM 22(9), 1979).

#version 460
#include "scene.glsl"

layout(local_size_x = 8, local_size_y = 8) in;
layout(push_constant, scalar) uniform PushBlock { AccumulatePush push; };
layout(rgba32f) readonly uniform image2D unit_sum;
layout(rgba32f) uniform image2D mean;
layout(rgba32f) uniform image2D squares;

void main() {
    ivec2 pixel = ivec2(gl_GlobalInvocationID.xy);
    if (any(greaterThanEqual(pixel, ivec2(scene.size)))) {
        return;
    }
    vec4 unit = imageLoad(unit_sum, pixel) / push.samples;
    vec4 before = imageLoad(mean, pixel);
    vec4 difference = unit - before;
    vec4 after = before + difference * (push.samples / push.samples_so_far);
    vec4 square = imageLoad(squares, pixel) + push.samples * difference * (unit - after);
    imageStore(mean, pixel, after);
    imageStore(squares, pixel, square);
}
