// A surface's BRDF: its value, its sampler, and the sampler's density.

#version 460
#include "scene.glsl"
#include "brdf.glsl"

layout(local_size_x = 64) in;
#include "push.glsl"
layout(scalar) readonly buffer InputBlock { BrdfInput at[]; } inputs;
layout(scalar) writeonly buffer OutputBlock { BrdfOutput at[]; } outputs;

void main() {
    uint id = gl_GlobalInvocationID.x;
    if (id >= push.count) {
        return;
    }
    BrdfInput i = inputs.at[id];
    Material material = make_material(push.surface);
    outputs.at[id] = BrdfOutput(brdf_value(material, i.normal, i.view, i.light),
                                brdf_pdf(material, i.normal, i.view, i.light),
                                brdf_sample(material, i.normal, i.view, i.u));
}
