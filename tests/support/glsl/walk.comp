// A random walk of free flights of mean length 1: the square of the distance that it comes to.

#version 460
#include "scene.glsl"
#include "random.glsl"
#include "phase.glsl"

layout(local_size_x = 64) in;
#include "push.glsl"
layout(scalar) readonly buffer InputBlock { Stream at[]; } inputs;
layout(scalar) writeonly buffer OutputBlock { Displacement at[]; } outputs;

void main() {
    uint id = gl_GlobalInvocationID.x;
    if (id >= push.count) {
        return;
    }
    Stream stream = inputs.at[id];
    Random random = Random(stream.pixel, stream.sample_index, stream.dimension);
    vec3 place = vec3(0.0);
    vec3 direction = vec3(0.0, 0.0, 1.0);
    for (uint flight = 0u; flight < push.flights; ++flight) {
        place += exponential(random_words(random).x) * direction;
        vec4 u = random_numbers(random);
        direction = scattered_direction(direction, phase_sample(u.x), u.y);
    }
    outputs.at[id].squared = dot(place, place);
}
