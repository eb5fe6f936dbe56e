// The suns' light on a surface, by a march towards each of them: shadows are exact at any scale of the cache, and
// have no noise.

#include "scene.glsl"
#include "brdf.glsl"
#include "light.glsl"
#include "loop.glsl"
#include "march.glsl"
#include "ray.glsl"
#include "surface.glsl"

// Loop iterations of a ray after which it marches to no more suns: in noisy data a ray may cross a surface hundreds of
// times. On a CPU, an eighth of the iterations after which lavapipe ends a loop, since eight threads may share that count;
// on a GPU, the limit bounds the time of a dispatch.
#ifdef IS_SOFTWARE
const uint ITERATIONS_FOR_SUNS = LAVAPIPE_ITERATIONS / 8u;
#else
const uint ITERATIONS_FOR_SUNS = 1u << 18u;
#endif

// Whether a ray that crosses surfaces has loop iterations left for marches to suns.
bool has_time_for_suns() {
    return sun_count == 0u || iterations <= ITERATIONS_FOR_SUNS;
}

// The share of a sun's light that reaches a surface; 0 where it is less than `least`.
float sun_reaching(vec3 g, Crossing crossing, vec3 towards_sun, float least) {
    Ray ray = make_ray(g, towards_sun);
    vec2 span = clip_ray(ray, 0.0);
    float share = 1.0;
    if (full_light) {
        share = surface_transmittance(ray, span.x, span.y, crossing.surface, crossing.inside);
    }
    return share > 0.0 ? share * marched_transmittance(ray, span.x, span.y, least) : 0.0;
}

// The suns' light that a surface reflects towards the beginning of `ray`.
vec3 sunlight_reflected(Ray ray, Crossing crossing, Hit hit, Material material, float least) {
    vec3 g = ray.origin + crossing.t * ray.step;
    vec3 radiance = vec3(0.0);
    for (uint s = 0u; s < sun_count; ++s) {
        Sun sun = sun_at(s);
        vec3 l = -sun.direction;
        float cosine = cosine_towards(hit, l);
        if (cosine > 0.0) {
            vec3 f = brdf_value(material, hit.shading_normal, -ray.direction, l);
            radiance += f * cosine * sun_reaching(g, crossing, l, least) * sun.irradiance;
        }
    }
    return radiance;
}
