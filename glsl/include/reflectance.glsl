// Reflection of light of which the cache knows two moments, the mean φ and the flux F. To first order the radiance that
// arrives from a direction l is φ − 3 F·l (F points where light travels), and a BRDF f reflects towards v
//
//   ∫ f (n·l) (φ − 3 F·l) dl = φ ρ₀ − 3 (F·n ρₙ + F·t ρₜ),
//   ρ₀ = ∫ f (n·l) dl,  ρₙ = ∫ f (n·l)² dl,  ρₜ = ∫ f (n·l)(t·l) dl,
//
// with t the unit tangent on the side of v. A Lambert surface of reflectance ρ reflects ρ (φ − 2 F·n): of the cosine's
// expansion in spherical harmonics that leaves out the second order and above (Ramamoorthi and Hanrahan, "An Efficient
// Representation for Irradiance Environment Maps", SIGGRAPH 2001). The integrals of other BRDFs are in a table
// (reflectance.comp).

#include "scene.glsl"
#include "brdf.glsl"
#include "cache.glsl"
#include "loop.glsl"
#include "nodes.glsl"
#include "pages.glsl"

layout(scalar) readonly buffer ReflectanceBlock { Reflectance at[]; } reflectances;

// The colour of light: its mean over channels is 1.
vec3 color_of(vec3 light) {
    return light / max(channel_mean(light), 1e-30);
}

// The flux of light whose mean is `mean`, interpolated between nodes whose indices are even. Nodes without memory, or on
// another side of the surfaces, do not count. The two stored fluxes are grey: the sky's own gets the sky's colour, the
// scattered one the colour of `mean` without the sky's own light.
mat3 flux_between_even_nodes(Cube cube, uint side, vec3 mean) {
    const float LEAST_SCATTERED = 0.01; // of each channel: the sky's light, from other nodes than the mean, may exceed it
    ivec3 last = (ivec3(scene.cache_nodes) - 1) & ~1;
    ivec3 low = min(cube.low & ~1, max(last - 2, 0));
    vec3 p = clamp((vec3(cube.low - low) + cube.p) / 2.0, 0.0, 1.0);
    TwoFluxes fluxes = TwoFluxes(0.0);
    float weights = 0.0;
    int k = 0;
    LOOP {
        ivec3 corner = ivec3(k, k >> 1, k >> 2) & 1;
        vec3 q = mix(1.0 - p, p, vec3(corner));
        ivec3 node = min(low + 2 * corner, last);
        if (has_memory(node) && is_on_side(node, side)) {
            float weight = q.x * q.y * q.z;
            fluxes += weight * two_fluxes_at(node_texel(node));
            weights += weight;
        }
        ++k;
        if (k == 8) {
            break;
        }
    }
    fluxes /= max(weights, 1e-30);
    vec3 sky = color_of(scene.sky);
    vec3 scattered = color_of(max(mean - fluxes[1].a * sky, LEAST_SCATTERED * mean));
    return outerProduct(fluxes[0].xyz, scattered) + outerProduct(fluxes[1].xyz, sky);
}

// The light at a point on this side of the surfaces. It may lie beside the medium and outside of all nodes: nodes without
// memory do not count, nor do those behind a surface, and guesses hardly do: the light is known unless all are guesses.
// False, with `light` as it was, if no node of the cube is left.
bool read_on_side(Cube cube, uint side, inout CachedLight light) {
    const float OF_A_GUESS = 1e-3;
    ivec3 last = ivec3(scene.cache_nodes) - 1;
    vec3 p = clamp(cube.p, 0.0, 1.0);
    CachedLight r = CachedLight(vec3(0.0), 0.0, mat3(0.0), false);
    float sum = 0.0;
    int k = 0;
    LOOP {
        ivec3 corner = ivec3(k, k >> 1, k >> 2) & 1;
        vec3 q = mix(1.0 - p, p, vec3(corner));
        ivec3 node = min(cube.low + corner, last);
        float weight = q.x * q.y * q.z;
        if (weight > 0.0 && has_memory(node) && is_on_side(node, side)) {
            ivec3 texel = node_texel(node);
            bool known = true;
            vec4 at_node = light_at(texel, known);
            weight *= known ? 1.0 : OF_A_GUESS;
            r.mean += weight * at_node.rgb;
            r.suns += weight * at_node.a;
            r.known = r.known || known;
            if (has_node_flux) {
                r.flux += weight * flux_at(texel);
            }
            sum += weight;
        }
        ++k;
        if (k == 8) {
            break;
        }
    }
    if (sum == 0.0) {
        return false;
    }
    light = CachedLight(r.mean / sum, r.suns / sum, r.flux / sum, r.known);
    return true;
}

// Interpolated between the angles of the table.
Reflectance reflectance_of(uint surface, Material material, float n_v) {
    if (!has_phong && !has_disney) {
        return Reflectance(material.surface.color, (2.0 / 3.0) * material.surface.color, vec3(0.0));
    }
    float at = clamp(n_v * float(REFLECTANCE_ANGLES) - 0.5, 0.0, float(REFLECTANCE_ANGLES - 1u));
    uint low = min(uint(at), REFLECTANCE_ANGLES - 2u);
    Reflectance a = reflectances.at[surface * REFLECTANCE_ANGLES + low];
    Reflectance b = reflectances.at[surface * REFLECTANCE_ANGLES + low + 1u];
    float t = at - float(low);
    return Reflectance(mix(a.albedo, b.albedo, t), mix(a.along_normal, b.along_normal, t),
                       mix(a.along_tangent, b.along_tangent, t));
}

// The light that a surface with normal n reflects towards v.
vec3 reflected_light(uint surface, Material material, vec3 n, vec3 v, CachedLight light) {
    float n_v = clamp(dot(n, v), 0.0, 1.0);
    Reflectance reflectance = reflectance_of(surface, material, n_v);
    vec3 across = v - n_v * n;
    float sine = length(across);
    vec3 tangent = sine > 0.0 ? across / sine : vec3(0.0);
    vec3 turned = n * light.flux * reflectance.along_normal + tangent * light.flux * reflectance.along_tangent;
    return max(vec3(0.0), light.mean * reflectance.albedo - 3.0 * turned);
}
