// The environment image: its mapping, its filter, its density, and its sampler.

#version 460
#include "scene.glsl"
#include "light.glsl"

layout(local_size_x = 64) in;
#include "push.glsl"
layout(scalar) readonly buffer InputBlock { SkyInput at[]; } inputs;
layout(scalar) writeonly buffer OutputBlock { SkyOutput at[]; } outputs;

void main() {
    uint id = gl_GlobalInvocationID.x;
    if (id >= push.count) {
        return;
    }
    SkyInput i = inputs.at[id];
    LightSample light = sample_image(i.u, i.word, i.pick);
    outputs.at[id] = SkyOutput(environment_position(i.direction), environment_image(i.direction),
                               environment_pdf(i.direction), light.towards, light.radiance,
                               light.pdf, escaping_radiance(i.direction, 0.0));
}
