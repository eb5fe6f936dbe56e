// The medium's mean between two values of the field, which is off a straight line half way.

#version 460
#include "scene.glsl"
#include "classification.glsl"

layout(local_size_x = 64) in;
#include "push.glsl"
layout(scalar) readonly buffer InputBlock { StepValues at[]; } inputs;
layout(scalar) writeonly buffer OutputBlock { MeanMedium at[]; } outputs;

void main() {
    uint id = gl_GlobalInvocationID.x;
    if (id < push.count) {
        StepValues pair = inputs.at[id];
        Classified a = classify(pair.a);
        Classified b = classify(pair.b);
        Medium medium = mean_medium(mean_along_bend(mean_between(a, b), pair.bend, a, b, step_ends_between(a, b)));
        outputs.at[id] = MeanMedium(medium.sigma_t, medium.albedo);
    }
}
