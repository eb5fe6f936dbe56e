// How surfaces reflect light of which only two moments are known (glsl/include/reflectance.glsl): integrals of each
// BRDF over the directions of light, a thread for each surface and each angle of view. They are sums over directions
// drawn by the BRDF's own sampler.

#version 460
#include "scene.glsl"
#include "brdf.glsl"
#include "random.glsl"

layout(local_size_x = 64) in;
layout(scalar) writeonly buffer ReflectanceBlock { Reflectance at[]; } reflectances;

const uint DIRECTIONS = 1024u;

void main() {
    uint index = gl_GlobalInvocationID.x;
    if (index >= surface_count * REFLECTANCE_ANGLES) {
        return;
    }
    Material material = make_material(index / REFLECTANCE_ANGLES);
    float n_v = (float(index % REFLECTANCE_ANGLES) + 0.5) / float(REFLECTANCE_ANGLES);
    const vec3 n = vec3(0.0, 0.0, 1.0);
    vec3 v = vec3(sqrt(1.0 - n_v * n_v), 0.0, n_v);
    Reflectance sum = Reflectance(vec3(0.0), vec3(0.0), vec3(0.0));
    for (uint i = 0u; i < DIRECTIONS; ++i) {
        vec3 u = unit_intervals(sobol_words(Random(index, i, 0u), 0u)).xyz;
        vec3 l = brdf_sample(material, n, v, u);
        float pdf = brdf_pdf(material, n, v, l);
        vec3 share = pdf > 0.0 ? brdf_value(material, n, v, l) * max(0.0, l.z) / pdf : vec3(0.0);
        sum.albedo += share;
        sum.along_normal += share * l.z;
        sum.along_tangent += share * l.x;
    }
    const float EACH = 1.0 / float(DIRECTIONS);
    reflectances.at[index] = Reflectance(EACH * sum.albedo, EACH * sum.along_normal, EACH * sum.along_tangent);
}
