// Lights: parallel suns, a constant environment, and an environment image.
//
// The constant part has no next-event estimation: it is equally bright in all directions, so that sampling it by the phase
// function or BRDF, as an escaping path does, has the least noise. Suns are picked by power, and so are the image's cells;
// between suns and image half and half.

#include "scene.glsl"
#include "phase.glsl"
#include "random.glsl"

layout(scalar) readonly buffer SunBlock { Sun at[]; } suns;
LOADED_AS(rgba32f) uniform texels2D environment;
layout(scalar) readonly buffer EnvironmentBlock { EnvironmentEntry at[]; } environment_table;

// Read once, as the scene's constants are; most scenes have a single sun.
Sun first_sun = suns.at[0];

Sun sun_at(uint index) {
    if (sun_count == 1u) {
        return first_sun;
    }
    return suns.at[index];
}

const bool has_light_sampling = sun_count > 0u || has_environment_image;

// u = ½ + atan2(d.x, −d.z)/2π, v = acos(d.y)/π.
vec2 environment_position(vec3 d) {
    float u = 0.5 + (d.x == 0.0 && d.z == 0.0 ? 0.0 : atan(d.x, -d.z)) / (2.0 * PI);
    // Not acos, which loses angles near the poles.
    return vec2(u, atan(length(d.xz), d.y) / PI);
}

// Bilinear, wrapping in u, clamped in v. By hand: a sampler may round its weights to 1/256.
vec3 environment_image(vec3 direction) {
    ivec2 size = size_in_texels(environment);
    vec2 p = environment_position(direction) * vec2(size) - 0.5;
    vec2 f = floor(p);
    vec2 t = p - f;
    ivec2 i = ivec2(f);
    ivec2 x = (ivec2(i.x, i.x + 1) + size.x) % size.x;
    ivec2 y = clamp(ivec2(i.y, i.y + 1), 0, size.y - 1);
    vec3 top = mix(texel_at(environment, ivec2(x[0], y[0])).rgb,
                   texel_at(environment, ivec2(x[1], y[0])).rgb, t.x);
    vec3 bottom = mix(texel_at(environment, ivec2(x[0], y[1])).rgb,
                      texel_at(environment, ivec2(x[1], y[1])).rgb, t.x);
    return mix(top, bottom, t.y);
}

// Density of `direction` in light sampling, 1/sr.
float environment_pdf(vec3 direction) {
    if (!has_environment_image) {
        return 0.0;
    }
    uvec2 cells = scene.image_cells;
    uvec2 cell = min(uvec2(environment_position(direction) * vec2(cells)), cells - 1u);
    return scene.image_probability * environment_table.at[cell.y * cells.x + cell.x].pdf;
}

// In place of a pdf, where no other strategy could have found the direction.
const float NO_MIS = -1.0;

// The radiance that a ray in `direction` brings from outside. `pdf` is the one with which the direction was
// sampled, for the balance heuristic against light sampling (Veach and Guibas 1995); NO_MIS for a ray from the camera.
vec3 escaping_radiance(vec3 direction, float pdf) {
    vec3 radiance = scene.environment;
    if (has_environment_image) {
        float both = max(pdf + environment_pdf(direction), 1e-30); // neither finds it: 0, not 0/0
        float weight = pdf == NO_MIS ? 1.0 : pdf / both;
        radiance += weight * environment_image(direction);
    }
    return radiance;
}

// What a ray from the camera sees where nothing is in its way.
vec3 background(vec3 direction) {
    if (background_is_transparent) {
        return vec3(0.0);
    }
    return background_is_color ? scene.background : escaping_radiance(direction, NO_MIS);
}

struct LightSample {
    vec3 towards;  // the light
    vec3 radiance; // divided by the pdf; for a sun, irradiance over probability
    float pdf;     // 1/sr; NO_MIS for a sun
    bool is_sun;
};

// cos(πx) from 0 to 1, to single precision. A device's own cosine may be off by 1/2048, a tenth of a cell at the
// poles.
float cos_pi(float x) {
    float a = 0.5 * PI * min(x, 1.0 - x);
    float b = a * a;
    float sine = a * (1.0 - b * (1.0 / 6.0 - b * (1.0 / 120.0 - b * (1.0 / 5040.0 - b / 362880.0))));
    float cosine = 1.0 - 2.0 * sine * sine;
    return x < 0.5 ? cosine : -cosine;
}

// `u` places the direction within its cell, `pick` chooses between the cell and its alias.
LightSample sample_image(vec2 u, uint word, float pick) {
    uvec2 cells = scene.image_cells;
    // The high word of a product: a float's 24 bits would favour some cells.
    uint cell, rest;
    umulExtended(word, cells.x * cells.y, cell, rest);
    if (pick >= environment_table.at[cell].threshold) {
        cell = environment_table.at[cell].alias;
    }
    // Uniform in solid angle within the cell: uniform in azimuth and in cos of the polar angle.
    float azimuth = 2.0 * PI * ((float(cell % cells.x) + u.x) / float(cells.x) - 0.5);
    float row = float(cell / cells.x);
    float y = mix(cos_pi(row / float(cells.y)), cos_pi((row + 1.0) / float(cells.y)), u.y);
    float r = sqrt(max(0.0, 1.0 - y * y));
    vec3 towards = vec3(r * sin(azimuth), y, -r * cos(azimuth));
    float pdf = scene.image_probability * environment_table.at[cell].pdf;
    return LightSample(towards, environment_image(towards) / pdf, pdf, false);
}

// One of the suns, picked by its power.
LightSample sample_sun(float pick) {
    uint index = 0u;
    while (index + 1u < sun_count && pick >= sun_at(index).cumulative_probability) {
        ++index;
    }
    float below = index > 0u ? sun_at(index - 1u).cumulative_probability : 0.0;
    Sun sun = sun_at(index);
    return LightSample(-sun.direction, sun.irradiance / (sun.cumulative_probability - below), NO_MIS, true);
}

// The last word is used twice: for the kind of light, and, stretched to [0, 1) again, for a cell or its alias.
LightSample sample_light(uvec4 words) {
    float kind = unit_interval(words.w);
    if (has_environment_image && kind < scene.image_probability) {
        vec2 u = vec2(unit_interval(words.x), unit_interval(words.y));
        return sample_image(u, words.z, kind / scene.image_probability);
    }
    LightSample light = sample_sun(unit_interval(words.z));
    light.radiance /= 1.0 - scene.image_probability;
    return light;
}

// Weight of light sampling against a path's own pdf of the same direction.
float light_weight(LightSample light, float pdf) {
    return light.pdf == NO_MIS ? 1.0 : light.pdf / (light.pdf + pdf);
}
