// Follows rays through the scene's isosurfaces, from crossing to crossing.

#version 460
#include "scene.glsl"
#include "ray.glsl"
#include "surface.glsl"

layout(local_size_x = 64) in;
#include "push.glsl"
layout(scalar) readonly buffer InputBlock { TestRay at[]; } inputs;
layout(scalar) writeonly buffer OutputBlock { Found at[]; } outputs;

void main() {
    uint id = gl_GlobalInvocationID.x;
    if (id >= push.rays) {
        return;
    }
    TestRay r = inputs.at[id];
    Ray ray = Ray(r.origin, r.step, normalize(r.step * scene.spacing));
    Search search = begin_search(ray, 0.0, r.known, r.inside);
    for (uint i = 0u; i < push.crossings; ++i) {
        Crossing crossing = find_crossing(ray, r.t_end, search);
        Found found = Found(crossing.t, crossing.surface, crossing.inside, vec3(0.0), vec3(0.0));
        if (crossing.surface >= 0) {
            found.position = ray.origin + crossing.t * ray.step;
            found.geometric = hit_at(ray, crossing).geometric_normal;
            pass_through(ray, crossing, search);
        }
        outputs.at[id * push.crossings + i] = found;
    }
}
