// The phase function's sampler and its density.

#version 460
#include "scene.glsl"
#include "random.glsl"
#include "phase.glsl"

layout(local_size_x = 64) in;
#include "push.glsl"
layout(scalar) readonly buffer InputBlock { PhaseInput at[]; } inputs;
layout(scalar) writeonly buffer OutputBlock { PhaseOutput at[]; } outputs;

void main() {
    uint id = gl_GlobalInvocationID.x;
    if (id < push.count) {
        outputs.at[id] = PhaseOutput(phase_sample_cosine(unit_interval(inputs.at[id].word)),
                                     phase_function(inputs.at[id].cosine));
    }
}
