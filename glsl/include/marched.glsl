// Counts the samples of the volume that a march takes, for the host to compare with the device's rate.

#include "scene.glsl"
#include "tracking.glsl"

layout(scalar) buffer MarchedBlock { Marched count; } marched;

// Adds the samples that this invocation has taken.
void count_samples() {
    uint before = atomicAdd(marched.count.low, lookups);
    if (before + lookups < before) {
        atomicAdd(marched.count.high, 1u);
    }
}
