// The published baseline's light transport (Šmajdek et al. 2023): a path in every cell, a few steps a dispatch. Its
// choices, none of which the other variants share:
//
// - A path begins anywhere in its cell, so that a cell holds the mean over its volume.
// - Free flights are tracked against the largest extinction of the whole transfer function.
// - No next-event estimation: a path finds light only when it leaves the volume, and a cell holds direct and indirect
//   light alike, averaged over directions whatever the phase function.
// - After MOST_BOUNCES collisions a path ends without light, and the light of long paths is missing.
// - A cell's mean is over the paths that have ended so far: early on, the short ones.
//
// The paper's light is an environment, which leaving paths find. A parallel sun they would never find: here it is a
// cone of SUN_ANGLE around its direction, whose radiance E/Ω brings the same fluence E. Its shadows are as soft as
// that cone, and its noise is that of hitting a 1/130th of the sphere by chance.

#version 460
#include "scene.glsl"
#include "counters.glsl"
#include "light.glsl"
#include "medium.glsl"
#include "phase.glsl"
#include "push.glsl"
#include "random.glsl"
#include "ray.glsl"

layout(local_size_x = 8, local_size_y = 8) in;
// Running mean of the radiance; alpha holds the number of paths.
layout(rgba32f) uniform image3D radiance_cells;
// Position in grid space; alpha holds the number of collisions.
layout(rgba32f) uniform image3D position_cells;
// Direction in world space, zero before the first path; alpha holds the red channel of the throughput.
layout(rgba32f) uniform image3D direction_cells;
// The green and blue channels of the throughput.
layout(rg32f) uniform image3D throughput_cells;

const uint MOST_BOUNCES = 64u;
const float SUN_ANGLE = radians(10.0);

struct CellPath {
    vec3 position;
    vec3 direction;
    vec3 throughput;
    uint bounces;
};

CellPath begin_path(ivec3 cell, inout Random random) {
    vec3 offset = random_numbers(random).xyz;
    vec2 u = random_numbers(random).xy;
    CellPath path;
    path.position = vec3(cell) + 0.5 + offset;
    path.direction = uniform_direction(u);
    path.throughput = vec3(1.0);
    path.bounces = 0u;
    return path;
}

bool is_outside(vec3 g) {
    bool outside = any(lessThan(g, vec3(0.5))) || any(greaterThan(g, vec3(scene.dims) + 0.5));
    vec3 p = to_world(g);
    for (uint c = 0u; c < clip_count; ++c) {
        outside = outside || dot(clips.at[c].normal, p) > clips.at[c].offset;
    }
    return outside;
}

vec3 light_from(vec3 direction) {
    vec3 radiance = escaping_radiance(direction, NO_MIS);
    float edge = cos(SUN_ANGLE);
    for (uint s = 0u; s < sun_count; ++s) {
        Sun sun = sun_at(s);
        if (-dot(direction, sun.direction) > edge) {
            radiance += sun.irradiance / (2.0 * PI * (1.0 - edge));
        }
    }
    return radiance;
}

void main() {
    ivec3 cell = ivec3(gl_GlobalInvocationID);
    if (any(greaterThanEqual(cell, ivec3(scene.dims)))) {
        return;
    }
    uint index = (cell.z * scene.dims.y + cell.y) * scene.dims.x + cell.x;
    Random random = Random(index, push.round, 0u);
    uint most_bounces = scene.max_bounces > 0u ? scene.max_bounces : MOST_BOUNCES;
    vec4 mean = imageLoad(radiance_cells, cell);
    vec4 position = imageLoad(position_cells, cell);
    vec4 direction = imageLoad(direction_cells, cell);
    CellPath path = CellPath(position.xyz, direction.xyz,
                             vec3(direction.w, imageLoad(throughput_cells, cell).xy),
                             uint(position.w));
    if (path.direction == vec3(0.0)) {
        path = begin_path(cell, random);
    }
    uint lookups = 0u;
    uint finished = 0u;
    for (uint i = 0u; i < push.steps; ++i) {
        uvec4 words = random_words(random);
        path.position += exponential(words.x) / push.majorant * path.direction / scene.spacing;
        bool leaves = !has_medium || is_outside(path.position);
        if (!leaves) {
            ++lookups;
            Medium medium = medium_at(path.position);
            if (unit_interval(words.y) * push.majorant < medium.sigma_t) {
                path.throughput *= medium.albedo;
                float x = phase_sample(unit_interval(words.z));
                path.direction = scattered_direction(path.direction, x, unit_interval(words.w));
                ++path.bounces;
            }
        }
        if (leaves || path.bounces >= most_bounces) {
            vec3 radiance = leaves ? path.throughput * light_from(path.direction) : vec3(0.0);
            mean.a += 1.0;
            mean.rgb += (radiance - mean.rgb) / mean.a;
            ++finished;
            path = begin_path(cell, random);
        }
    }
    imageStore(radiance_cells, cell, mean);
    imageStore(position_cells, cell, vec4(path.position, path.bounces));
    imageStore(direction_cells, cell, vec4(path.direction, path.throughput.r));
    imageStore(throughput_cells, cell, vec4(path.throughput.gb, 0.0, 0.0));
    atomicAdd(counters.count.lookups, lookups);
    atomicAdd(counters.count.finished, finished);
}
