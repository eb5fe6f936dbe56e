// Folds units, each pixel's sums over the same number of samples, into its running mean and into the weighted sum of
// squared differences from it (West, CACM 22(9), 1979).

#version 460
#include "scene.glsl"
#include "bundle.glsl"
#include "push.glsl"

layout(local_size_x = 8, local_size_y = 8) in;
layout(rgba32f) readonly uniform image2D unit_sum;
layout(rgba32f) uniform image2D mean;
layout(rgba32f) uniform image2D squares;

void main() {
    uvec2 thread = gl_GlobalInvocationID.xy;
    uint position = push.first + thread.y * scene.size.x + thread.x;
    if (thread.x >= scene.size.x || position >= push.end) {
        return;
    }
    // A thread works on its own texel where it can: integer divisions are slow.
    ivec2 pixel = is_in_bricks ? texel_at_index(pixel_at(position)) : ivec2(thread);
    vec4 average = imageLoad(mean, pixel);
    vec4 square = imageLoad(squares, pixel);
    uint so_far = push.samples_before;
    // `precise`, so that it does not matter how many units are folded at once.
    for (uint unit = 0u; unit < units_together(); ++unit) {
        so_far += push.samples;
        ivec2 texel = is_in_bricks ? texel_of(position * units_together() + unit) : pixel;
        precise vec4 sample_mean = imageLoad(unit_sum, texel) / float(push.samples);
        precise vec4 difference = sample_mean - average;
        precise vec4 after = average + difference * (float(push.samples) / float(so_far));
        precise vec4 squared = square + float(push.samples) * difference * (sample_mean - after);
        average = after;
        square = squared;
    }
    imageStore(mean, pixel, average);
    imageStore(squares, pixel, square);
}
