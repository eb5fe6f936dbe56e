// The light of the cache (cache.glsl) that the medium scatters.

// The flux over the mean. The flux's colour is that of the mean, beside that of the lights.
//
// No light has more flux than mean. Noise and interpolation may make some that seems to, and in the dark the quotient
// would overflow.
vec3 flux_share(CachedLight light) {
    float grey = dot(light.mean, vec3(1.0 / 3.0));
    return light.flux / max(max(grey, length(light.flux)), 1e-30);
}

// ∫ p(ω, ω') L(ω') dω' with the first two moments of L: (φ + 3g F·ω)/4π; `travel` is the direction of
// light on its way out.
vec3 scattered_light(CachedLight light, vec3 travel) {
    vec3 radiance = light.mean * scene.cache_unit;
    if (!is_anisotropic) {
        return radiance;
    }
    return radiance * (1.0 + 3.0 * scene.g * dot(flux_share(light), travel));
}

// The suns' scattered light if all of it reached the point: Σ p(ω, ω_sun)·E.
vec3 suns_scattered(vec3 travel) {
    vec3 sum = vec3(0.0);
    for (uint s = 0u; s < sun_count; ++s) {
        Sun sun = sun_at(s);
        sum += phase_density(dot(sun.direction, travel)) * sun.irradiance;
    }
    return sum;
}
