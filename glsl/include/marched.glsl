// Counts the lookups of the volume that a march makes, for the host to compare with the device's rate.

#include "scene.glsl"
#include "tracking.glsl"

layout(scalar) buffer MarchedBlock { Marched count; } marched;

// Adds the lookups that this invocation has made.
void count_lookups() {
    uint before = atomicAdd(marched.count.low, lookups);
    if (before + lookups < before) {
        atomicAdd(marched.count.high, 1u);
    }
}
