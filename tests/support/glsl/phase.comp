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
        PhaseInput ask = inputs.at[id];
        outputs.at[id] = PhaseOutput(phase_sample(unit_interval(ask.word)), phase_function_at(ask.x),
                                     phase_function(ask.before, ask.after));
    }
}
