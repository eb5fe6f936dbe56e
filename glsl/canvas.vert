// Triangles in pixels, read through their indices.

#version 460
#extension GL_EXT_scalar_block_layout : require
#include "canvas.glsl"

layout(binding = VERTICES, scalar) readonly buffer Vertices { CanvasVertex vertices[]; };
layout(binding = INDICES, scalar) readonly buffer Indices { uint indices[]; };
layout(location = 0) out vec2 uv;
layout(location = 1) out vec4 color;

void main() {
    CanvasVertex v = vertices[indices[gl_VertexIndex]];
    uv = v.uv * push.texel;
    color = unpackUnorm4x8(v.color);
    gl_Position = vec4(2.0 * v.position / push.size - 1.0, 0.0, 1.0);
}
