// BRDFs: f(ω, ω') per steradian with n the shading normal, v towards the viewer, l towards the light.
// Sampling returns a direction; `brdf_pdf` is that of the mixture it was drawn from.

#include "scene.glsl"
#include "close_to_one.glsl"
#include "phase.glsl"
#include "surface.glsl"

struct Material {
    Surface surface;
    float alpha; // GGX width: max(roughness², 1e-3)
    float diffuse_probability; // of each lobe in sampling
    float specular_probability;
};

// As in Burley's own implementation (disney.brdf).
float luminance(vec3 color) {
    return dot(color, vec3(0.3, 0.6, 0.1));
}

Material make_material(uint index) {
    Material m;
    m.surface = surface_at(index);
    m.alpha = max(m.surface.roughness * m.surface.roughness, 1e-3);
    m.diffuse_probability = 1.0;
    m.specular_probability = 0.0;
    if (has_phong && m.surface.shading == SHADING_PHONG) {
        m.specular_probability = m.surface.specular;
        m.diffuse_probability = 1.0 - m.specular_probability;
    }
    if (has_disney && m.surface.shading == SHADING_DISNEY) {
        // Probabilities only steer sampling: any that are above 0 are right.
        float diffuse = (1.0 - m.surface.metallic) * max(luminance(m.surface.color), 0.1);
        float specular = mix(0.2 + 0.3 * m.surface.specular, 1.0, m.surface.metallic);
        float coat = 0.25 * m.surface.clearcoat;
        float sum = diffuse + specular + coat;
        m.diffuse_probability = diffuse / sum;
        m.specular_probability = specular / sum;
    }
    return m;
}

float schlick(float cosine) {
    float m = clamp(1.0 - cosine, 0.0, 1.0);
    return m * m * m * m * m;
}

// The half vector's sin² to the normal. From the cross product, since 1 − cos² would lose the digits
// of narrow lobes.
float sine_squared(vec3 n, vec3 h) {
    vec3 across = cross(n, h);
    return dot(across, across);
}

// Trowbridge–Reitz, γ = 2.
float ggx_d(float sine2, float alpha) {
    float a2 = alpha * alpha;
    float d = mix(a2, 1.0, sine2);
    return a2 / (PI * d * d);
}

// γ = 1, Burley's clearcoat.
float gtr1_d(float sine2, float alpha) {
    float a2 = alpha * alpha;
    return (a2 - 1.0) / (PI * log(a2) * mix(a2, 1.0, sine2));
}

// Smith's masking of one direction over twice its cosine, so that two of them make G / (4·n·l·n·v).
float smith_over_2cos(float cosine, float alpha) {
    float a2 = alpha * alpha;
    return 1.0 / (cosine + sqrt(a2 + cosine * cosine - a2 * cosine * cosine));
}

float clearcoat_alpha(Material m) {
    return mix(0.1, 0.001, m.surface.clearcoat_gloss);
}

// Burley, "Physically Based Shading at Disney" (2012), isotropic.
vec3 disney(Material m, float n_v, float n_l, float h_sine2, float l_h) {
    Surface s = m.surface;
    float brightness = luminance(s.color);
    vec3 tint = brightness > 0.0 ? s.color / brightness : vec3(1.0);
    vec3 f0 = mix(0.08 * s.specular * mix(vec3(1.0), tint, s.specular_tint), s.color, s.metallic);
    float fl = schlick(n_l);
    float fv = schlick(n_v);
    float fh = schlick(l_h);
    float fd90 = 0.5 + 2.0 * l_h * l_h * s.roughness;
    float fd = mix(1.0, fd90, fl) * mix(1.0, fd90, fv);
    float fss90 = l_h * l_h * s.roughness;
    float fss = mix(1.0, fss90, fl) * mix(1.0, fss90, fv);
    float ss = 1.25 * (fss * (1.0 / (n_l + n_v) - 0.5) + 0.5);
    vec3 sheen = s.sheen * fh * mix(vec3(1.0), tint, s.sheen_tint);
    vec3 diffuse = (s.color / PI * mix(fd, ss, s.subsurface) + sheen) * (1.0 - s.metallic);
    vec3 specular = ggx_d(h_sine2, m.alpha) * smith_over_2cos(n_l, m.alpha)
                  * smith_over_2cos(n_v, m.alpha) * mix(f0, vec3(1.0), fh);
    float coat = 0.25 * s.clearcoat * gtr1_d(h_sine2, clearcoat_alpha(m)) * mix(0.04, 1.0, fh)
               * smith_over_2cos(n_l, 0.25) * smith_over_2cos(n_v, 0.25);
    return diffuse + specular + coat;
}

// The k-th power of the cosine from the mirror direction, 1 − x, by the series of its logarithm where a float would not know
// the cosine well enough for a large k.
float phong_lobe(Material m, vec3 n, vec3 v, vec3 l) {
    float x = one_minus_dot(reflect(-v, n), l);
    if (x < 0.01) {
        return exp(-m.surface.shininess * x * (1.0 + x * (0.5 + x * (1.0 / 3.0))));
    }
    return x < 1.0 ? pow(1.0 - x, m.surface.shininess) : 0.0;
}

// f(v, l); zero below the shading hemisphere.
vec3 brdf_value(Material m, vec3 n, vec3 v, vec3 l) {
    float n_l = dot(n, l);
    float n_v = dot(n, v);
    if (n_l <= 0.0 || n_v <= 0.0) {
        return vec3(0.0);
    }
    if (has_disney && m.surface.shading == SHADING_DISNEY) {
        vec3 h = normalize(l + v);
        return disney(m, n_v, n_l, sine_squared(n, h), dot(l, h));
    }
    if (has_phong && m.surface.shading == SHADING_PHONG) {
        return (1.0 - m.surface.specular) * m.surface.color / PI
             + m.surface.specular * (m.surface.shininess + 2.0) / (2.0 * PI) * phong_lobe(m, n, v, l);
    }
    return m.surface.color / PI;
}

// Density of l, per steradian, in `brdf_sample`.
float brdf_pdf(Material m, vec3 n, vec3 v, vec3 l) {
    float n_l = dot(n, l);
    float pdf = m.diffuse_probability * max(0.0, n_l) / PI;
    if (has_disney && m.surface.shading == SHADING_DISNEY) {
        vec3 h = normalize(l + v);
        float h_sine2 = sine_squared(n, h);
        // The density of h is D·(n·h); the Jacobian of h to l is 1/(4 l·h) = 1/(2|l + v|), which does not cancel where l is
        // near −v (Walter et al., "Microfacet Models for Refraction through Rough Surfaces", 2007).
        float jacobian = max(dot(n, h), 0.0) / max(2.0 * length(l + v), 1e-12);
        float coat_probability = 1.0 - m.diffuse_probability - m.specular_probability;
        pdf += jacobian * (m.specular_probability * ggx_d(h_sine2, m.alpha)
                             + coat_probability * gtr1_d(h_sine2, clearcoat_alpha(m)));
    }
    if (has_phong && m.surface.shading == SHADING_PHONG) {
        pdf += m.specular_probability * (m.surface.shininess + 1.0) / (2.0 * PI) * phong_lobe(m, n, v, l);
    }
    return pdf;
}

// A direction from the mixture of lobes; u.z picks the lobe. It may lie below the surface.
vec3 brdf_sample(Material m, vec3 n, vec3 v, vec3 u) {
    if (has_phong && m.surface.shading == SHADING_PHONG && u.z >= m.diffuse_probability) {
        // 1 − cosine, of which the power is uniform.
        float x = one_minus_exp(max(0.0, -log(1.0 - u.x)) / (m.surface.shininess + 1.0)); // a device's log may err
        return direction_at(reflect(-v, n), 1.0 - x, sqrt(x * (2.0 - x)), u.y);
    }
    if (has_disney && m.surface.shading == SHADING_DISNEY && u.z >= m.diffuse_probability) {
        float sine2;
        if (u.z < m.diffuse_probability + m.specular_probability) {
            float a2 = m.alpha * m.alpha;
            // sin²θ_h of GGX: α²u/(1 − u + α²u), from tan²θ_h = α²u/(1 − u) (Walter et al. 2007, eq. 35).
            sine2 = a2 * u.x / (1.0 - u.x + a2 * u.x);
        } else {
            float alpha = clearcoat_alpha(m);
            float a2 = alpha * alpha;
            // Of GTR1: (α^{2(1−u)} − α²)/(1 − α²) (Burley 2012, appendix B).
            sine2 = (pow(a2, 1.0 - u.x) - a2) / (1.0 - a2);
        }
        sine2 = clamp(sine2, 0.0, 1.0);
        vec3 h = direction_at(n, sqrt(1.0 - sine2), sqrt(sine2), u.y);
        return reflect(-v, h);
    }
    return direction_around(n, sqrt(1.0 - u.x), u.y);
}
