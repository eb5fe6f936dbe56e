// The push constants that both stages of drawing a user interface share.

#include "shared.glsl"

layout(push_constant, scalar) uniform PushBlock { CanvasPush push; };
