// The cache: light that arrives at the nodes of a lattice (nodes.glsl).
//
// A node holds, averaged over directions, the radiance that arrives scattered or from the sky (RGB), and the mean
// transmittance towards the suns, weighted by their irradiance (A). Suns are kept apart because their light has edges: what
// is read from the cache is corrected by a shadow ray at rest. A second image holds the flux of the same light (RGB are its
// components). In an anisotropic medium it does so at every node; each channel has a flux of its own, in texels side by
// side, where light has several colours. In an isotropic medium only surfaces ask for the direction of light, and nodes
// whose indices are even hold two fluxes of grey light side by side: of scattered light, and of the sky's own, which comes
// from elsewhere and in another colour.
//
// Nodes whose light is neither traced nor interpolated yet hold a guess, marked by a negative A. Where none of the view's
// rays reads a node, it keeps the guess (src/render/cache/focus.rs): a path that comes there continues as if there were no
// cache.
//
// Values are in units of scene.cache_unit: they are near 1, and stay right when all lights are dimmed or coloured alike.

#include "scene.glsl"
#include "nodes.glsl"
#include "pages.glsl"

LOADED_AS(CACHE_FORMAT) uniform texels3D cache_light;
LOADED_AS(CACHE_FORMAT) uniform texels3D cache_flux;
// CUT_WORDS for each brick: a bit for each cube, if a surface cuts it, and two bits for each node, which tell on what side
// of the surfaces it is (`side_of_surfaces`).
layout(scalar) readonly buffer CutBlock { uint at[]; } cuts;
// RIM_WORDS for each brick: a bit for each cube, if it is at the rim (rim_cubes.comp).
layout(scalar) readonly buffer RimBlock { uint at[]; } rims;

bool is_cut(Cube cube) {
    uvec2 bit = bit_of(cube.low, CUT_WORDS);
    return (cuts.at[bit.x] >> bit.y & 1u) != 0u;
}

// The side of surfaces that stop light on which a node with memory is: how many of them it is behind, modulo 4.
uint side_of_node(ivec3 node) {
    uvec2 bits = side_bits_of(node);
    return cuts.at[bits.x] >> bits.y & 3u;
}

// Whether no surface that stops light is known to stand between a node with memory and a point on this side.
bool is_on_side(ivec3 node, uint side) {
    return !full_light || side_of_node(node) == side;
}

bool is_rim(Cube cube) {
    uvec2 bit = bit_of(cube.low, RIM_WORDS);
    return (rims.at[bit.x] >> bit.y & 1u) != 0u;
}

// Whether the nodes around a cube do not tell the light in it: some may lie behind a surface, or light bends too much
// between them. Paths go on there as if there were no cache.
bool is_left_to_paths(Cube cube) {
    return full_light && is_cut(cube) || has_rim_cubes && is_rim(cube);
}

// Whether each channel of the light has a flux of its own.
bool has_colored_flux() {
    return has_node_flux && flux_columns == 3u;
}

// Position of a channel's flux in an anisotropic medium, if `texel` is that of a node's light.
ivec3 flux_texel(ivec3 texel, int channel) {
    return ivec3(3 * texel.x + channel, texel.yz);
}

// The flux at a node whose light has this texel.
mat3 flux_at(ivec3 texel) {
    if (!has_colored_flux()) {
        vec3 flux = texel_at(cache_flux, texel).rgb;
        return mat3(flux, flux, flux);
    }
    return mat3(texel_at(cache_flux, flux_texel(texel, 0)).rgb,
                texel_at(cache_flux, flux_texel(texel, 1)).rgb,
                texel_at(cache_flux, flux_texel(texel, 2)).rgb);
}

float channel_mean(vec3 light) {
    return dot(light, vec3(1.0 / 3.0));
}

// The fluxes of grey light at an even node of an isotropic medium: of scattered light in the first column; in the second one
// that of the sky's own light, and in its alpha the mean of that light.
#define TwoFluxes mat2x4

// Position of a column, if `texel` is that of an even node's light.
ivec3 two_fluxes_texel(ivec3 texel, int column) {
    return ivec3(texel.x + column, texel.yz / 2);
}

TwoFluxes two_fluxes_at(ivec3 texel) {
    return TwoFluxes(texel_at(cache_flux, two_fluxes_texel(texel, 0)), texel_at(cache_flux, two_fluxes_texel(texel, 1)));
}

struct CachedLight {
    vec3 mean;  // radiance over all directions, without the suns' own, in cache_units
    float suns; // mean transmittance towards the suns
    mat3 flux;  // mean of that radiance times direction of travel, a column for each channel
    bool known; // false if it is a guess, in part
};

// A texel that marks its light as a guess.
vec4 as_guess(vec4 light) {
    const float LEAST = 1e-3; // 0 has no sign that could mark it
    return vec4(light.rgb, -max(abs(light.a), LEAST));
}

// A node's light. `known` becomes false if that is a guess.
vec4 light_at(ivec3 texel, inout bool known) {
    vec4 light = texel_at(cache_light, texel);
    known = known && light.a >= 0.0;
    return vec4(light.rgb, abs(light.a));
}

CachedLight read_cache(Cube cube) {
    ivec3 a = cube.low;
    ivec3 b = min(a + 1, ivec3(scene.cache_nodes) - 1);
    ivec3 texels[8] = ivec3[8](
        node_texel(a), node_texel(ivec3(b.x, a.yz)),
        node_texel(ivec3(a.x, b.y, a.z)), node_texel(ivec3(b.xy, a.z)),
        node_texel(ivec3(a.xy, b.z)), node_texel(ivec3(b.x, a.y, b.z)),
        node_texel(ivec3(a.x, b.yz)), node_texel(b));
    vec3 p = cube.p;
    vec3 q = 1.0 - p;
    vec4 weights = vec4(q.x * q.y, p.x * q.y, q.x * p.y, p.x * p.y);
    vec4 near = weights * q.z;
    vec4 far = weights * p.z;
    bool known = true;
    vec4 light = near.x * light_at(texels[0], known)
               + near.y * light_at(texels[1], known)
               + near.z * light_at(texels[2], known)
               + near.w * light_at(texels[3], known)
               + far.x * light_at(texels[4], known)
               + far.y * light_at(texels[5], known)
               + far.z * light_at(texels[6], known)
               + far.w * light_at(texels[7], known);
    light = max(light, 0.0); // extrapolation may become negative
    CachedLight r = CachedLight(light.rgb, light.a, mat3(0.0), known);
    if (has_node_flux) {
        r.flux = near.x * flux_at(texels[0])
               + near.y * flux_at(texels[1])
               + near.z * flux_at(texels[2])
               + near.w * flux_at(texels[3])
               + far.x * flux_at(texels[4])
               + far.y * flux_at(texels[5])
               + far.z * flux_at(texels[6])
               + far.w * flux_at(texels[7]);
    }
    return r;
}

const float LARGEST_F16 = 65504.0;

// Rounds mantissas to the 10 bits of a 16-bit float, to nearest even, since a device's own conversion may round towards
// zero. (Denormals are left to that conversion.) Values are clamped to the largest 16-bit float: with a very narrow phase
// function a node's first paths can exceed it, and an infinity would stay in the running mean for ever.
vec4 rounded(vec4 x) {
    if (!cache_is_f16) {
        return x;
    }
    uvec4 bits = floatBitsToUint(clamp(x, -LARGEST_F16, LARGEST_F16));
    bits += 0xFFFu + (bits >> 13u & 1u);
    return uintBitsToFloat(bits & ~0x1FFFu);
}

// A node's light; `known` becomes false if it has no memory, or holds a guess.
vec3 node_light(ivec3 node, inout bool known) {
    uint page = page_of(node / BRICK);
    known = known && page != NO_PLACE;
    return light_at(BRICK * unpacked(page) + node % BRICK, known).rgb;
}

// The components of a vector from one axis on, in turn. (Compilers keep vectors in memory that are indexed.)
vec3 from_axis(uint axis, vec3 v) {
    return axis == 0u ? v : axis == 1u ? v.yzx : v.zxy;
}

ivec3 from_axis(uint axis, ivec3 v) {
    return axis == 0u ? v : axis == 1u ? v.yzx : v.zxy;
}

// The vector whose components from an axis on these are.
ivec3 back_from_axis(uint axis, ivec3 v) {
    return axis == 0u ? v : axis == 1u ? v.zxy : v.yzx;
}

// A step along an axis.
ivec3 along(uint axis) {
    return back_from_axis(axis, ivec3(1, 0, 0));
}

// Light in a plane of nodes across `axis`, interpolated between the four nodes from `low` on. Vectors begin with that axis.
vec3 light_across(uint axis, ivec3 low, vec3 p, inout bool known) {
    ivec3 high = min(low + 1, from_axis(axis, ivec3(scene.cache_nodes)) - 1);
    vec3 light = (1.0 - p.y) * (1.0 - p.z) * node_light(back_from_axis(axis, low), known);
    light += p.y * (1.0 - p.z) * node_light(back_from_axis(axis, ivec3(low.x, high.y, low.z)), known);
    light += p.y * p.z * node_light(back_from_axis(axis, ivec3(low.x, high.yz)), known);
    return light + (1.0 - p.y) * p.z * node_light(back_from_axis(axis, ivec3(low.xy, high.z)), known);
}

// What has to be added to read_cache where light is curved along an axis: −½·p(1 − p)·f″, the remainder of linear
// interpolation at a share p of the way, with f″ from the nodes on both sides.
vec3 curvature_correction(uint axis, Cube cube) {
    const ivec3 ALONG = ivec3(1, 0, 0); // with `axis` at first
    ivec3 e = along(axis);
    ivec3 low = from_axis(axis, cube.low);
    vec3 p = from_axis(axis, cube.p);
    bool known = low.x >= 1 && low.x + 2 < from_axis(axis, ivec3(scene.cache_nodes)).x;
    if (!known || full_light && (is_cut(Cube(cube.low - e, cube.p)) || is_cut(Cube(cube.low + e, cube.p)))) {
        return vec3(0.0);
    }
    vec3 a = light_across(axis, low - ALONG, p, known);
    vec3 b = light_across(axis, low, p, known);
    vec3 c = light_across(axis, low + ALONG, p, known);
    vec3 d = light_across(axis, low + 2 * ALONG, p, known);
    vec3 curvature = mix(a - 2.0 * b + c, b - 2.0 * c + d, p.x);
    return known ? -0.5 * p.x * (1.0 - p.x) * curvature : vec3(0.0);
}

// The same for all three axes.
vec3 interpolation_correction(Cube cube) {
    return curvature_correction(0u, cube) + curvature_correction(1u, cube) + curvature_correction(2u, cube);
}
