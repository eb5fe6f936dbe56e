// How shaders read an image texel by texel. A GPU's texture units are made for that. A CPU's driver handles all
// features of a sampler for each texel; to load a texel from a storage image it only has to know the format.

#ifdef LOADS_TEXELS

#define LOADED_AS(format) layout(format)
#define texels2D readonly image2D
#define texels3D readonly image3D
#define utexels2D readonly uimage2D
#define utexels3D readonly uimage3D
#define texel_at(image, at) imageLoad(image, at)
#define size_in_texels(image) imageSize(image)

#else

#define LOADED_AS(format)
#define texels2D sampler2D
#define texels3D sampler3D
#define utexels2D usampler2D
#define utexels3D usampler3D
#define texel_at(image, at) texelFetch(image, at, 0)
#define size_in_texels(image) textureSize(image, 0)

#endif
