// What a random word is turned into.

#version 460
#include "scene.glsl"
#include "random.glsl"

layout(local_size_x = 64) in;
#include "push.glsl"
layout(scalar) readonly buffer InputBlock { RandomWord at[]; } inputs;
layout(scalar) writeonly buffer OutputBlock { Transformed at[]; } outputs;

void main() {
    uint id = gl_GlobalInvocationID.x;
    if (id < push.count) {
        uint word = inputs.at[id].word;
        outputs.at[id] = Transformed(exponential(word), unit_interval(word));
    }
}
