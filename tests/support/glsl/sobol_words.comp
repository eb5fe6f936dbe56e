// Two pairs of a sample's low-discrepancy numbers; the stream's dimension says which.

#version 460
#include "scene.glsl"
#include "random.glsl"

layout(local_size_x = 64) in;
#include "push.glsl"
layout(scalar) readonly buffer InputBlock { Stream at[]; } inputs;
layout(scalar) writeonly buffer OutputBlock { Words at[]; } outputs;

void main() {
    uint id = gl_GlobalInvocationID.x;
    if (id < push.count) {
        Stream stream = inputs.at[id];
        Random random = Random(stream.pixel, stream.sample_index, 0u);
        uvec4 words = sobol_words(random, stream.dimension);
        outputs.at[id] = Words(words.x, words.y, words.z, words.w);
    }
}
