// What a pass counts for the host, and where its queue stands.

#include "shared.glsl"

layout(scalar) buffer CounterBlock { Counters count; } counters;
