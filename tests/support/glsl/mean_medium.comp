// The medium's mean between two values of the field.

#version 460
#include "scene.glsl"
#include "medium.glsl"

layout(local_size_x = 64) in;
#include "push.glsl"
layout(scalar) readonly buffer InputBlock { ValuePair at[]; } inputs;
layout(scalar) writeonly buffer OutputBlock { MeanMedium at[]; } outputs;

void main() {
    uint id = gl_GlobalInvocationID.x;
    if (id < push.count) {
        ValuePair pair = inputs.at[id];
        Medium medium = mean_medium(classify(pair.a), classify(pair.b));
        outputs.at[id] = MeanMedium(medium.sigma_t, medium.albedo);
    }
}
