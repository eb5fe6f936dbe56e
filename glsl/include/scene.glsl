// The scene's constants, and the data that CPU and GPU share (src/render/shared.rs). A shader includes this file first,
// since extensions are asked for before anything else.

#extension GL_EXT_scalar_block_layout : require
#ifdef VOTES
#extension GL_KHR_shader_subgroup_vote : require
#endif
#include "texels.glsl"
#include "shared.glsl"

layout(scalar) readonly buffer SceneBlock { SceneConstants constants; } scene_block;
// Read once: lavapipe reads a buffer thread by thread wherever control flow has diverged.
SceneConstants scene = scene_block.constants;

const float LARGEST = 3.4e38; // nearly the largest float

// Pixels, and other texels of a picture, are counted row by row.
ivec2 texel_at_index(uint index) {
    return ivec2(index % scene.size.x, index / scene.size.x);
}

uint index_of_texel(ivec2 texel) {
    return uint(texel.y) * scene.size.x + uint(texel.x);
}
