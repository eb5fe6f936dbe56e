// The light of the cache (cache.glsl) that the medium scatters.

#include "scene.glsl"
#include "cache.glsl"
#include "light.glsl"
#include "phase.glsl"
#include "ray.glsl"

// ∫ p(ω, ω') L(ω') dω' with the first two moments of L, its mean φ and its flux F: φ + 3g F·ω; `travel` is the direction ω
// of light on its way out.
vec3 scattered_light(CachedLight light, vec3 travel) {
    vec3 radiance = light.mean;
    if (is_anisotropic) {
        radiance += 3.0 * scene.g * (travel * light.flux);
    }
    return radiance * scene.cache_unit;
}

// The suns' scattered light if all of it reached the point: Σ p(ω, ω_sun)·E.
vec3 suns_scattered(vec3 travel) {
    vec3 sum = vec3(0.0);
    for (uint s = 0u; s < sun_count; ++s) {
        Sun sun = sun_at(s);
        sum += phase_function(sun.direction, travel) * sun.irradiance;
    }
    return sum;
}

// The part of the light that is scattered towards the ray's beginning, without the suns' own.
vec3 scattered_back(CachedLight light, Ray ray) {
    return max(vec3(0.0), scattered_light(light, -ray.direction));
}
