// Stores what cache.glsl reads of the flux.

#include "scene.glsl"
#include "cache.glsl"

layout(CACHE_FORMAT) writeonly uniform image3D flux_out;

void store_flux(ivec3 texel, mat3 flux) {
    if (!has_colored_flux()) {
        imageStore(flux_out, texel, rounded(vec4(flux[0], 0.0)));
        return;
    }
    imageStore(flux_out, flux_texel(texel, 0), rounded(vec4(flux[0], 0.0)));
    imageStore(flux_out, flux_texel(texel, 1), rounded(vec4(flux[1], 0.0)));
    imageStore(flux_out, flux_texel(texel, 2), rounded(vec4(flux[2], 0.0)));
}

void store_two_fluxes(ivec3 texel, TwoFluxes fluxes) {
    imageStore(flux_out, two_fluxes_texel(texel, 0), rounded(fluxes[0]));
    imageStore(flux_out, two_fluxes_texel(texel, 1), rounded(fluxes[1]));
}
