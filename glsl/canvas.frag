// The texture times the triangle's colour, both premultiplied and encoded for display, as user
// interfaces blend them.

#version 460
#extension GL_EXT_scalar_block_layout : require
#include "canvas.glsl"

layout(binding = ATLAS) uniform sampler2D atlas;
layout(location = 0) in vec2 uv;
layout(location = 1) in vec4 color;
layout(location = 0) out vec4 result;

void main() {
    result = color * texture(atlas, uv);
}
