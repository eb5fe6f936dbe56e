// The bricks of the cache, place by place.

#include "scene.glsl"

layout(scalar) buffer BrickBlock { Brick at[]; } bricks;
