// The image of patches has two texels for each patch, side by side: the complement of the nearest distance, and the
// farthest distance (patches.comp). Behind the last row of patches are those of what may be anywhere in the picture.

#include "scene.glsl"

const ivec2 WHOLE_PICTURE = ivec2(0, PATCHES);
