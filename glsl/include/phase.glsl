// Henyey and Greenstein (1941): p = (1 − g²)/(4π(1 + g² − 2g·cosθ)^{3/2}), in 1/sr; g > 0 scatters forward. Directions are
// those of travel.
//
// Where g is close to ±1, the lobe is narrower than a float knows a cosine near ±1. So angles are counted from the lobe's
// axis, the direction before or (g < 0) the one opposite to it, and stand as x = 1 − cosine, which keeps its digits
// where the lobe is.

#include "scene.glsl"
#include "close_to_one.glsl"

const float PI = 3.14159265358979;

// 1/sr, at x from the lobe's axis.
float phase_function_at(float x) {
    if (!is_anisotropic) {
        return 0.25 / PI;
    }
    float g = abs(scene.g);
    // 1 + g² − 2g·cosine
    float d = (1.0 - g) * (1.0 - g) + 2.0 * g * x;
    return 0.25 / PI * (1.0 - g) * (1.0 + g) / (d * sqrt(d));
}

float phase_function(vec3 before, vec3 after) {
    return is_anisotropic ? phase_function_at(one_minus_dot(before, scene.g < 0.0 ? -after : after)) : 0.25 / PI;
}

// A sample of x = 1 − cosθ by inverting the cumulative distribution: with s = 1 − g + 2gu, x = 2(1 − u)(1 + gu)((1 − g)/s)².
// This equals the textbook (1 + g² − ((1 − g²)/s)²)/(2g) for cosθ, but neither divides by g nor cancels where g is small.
float phase_sample(float u) {
    if (!is_anisotropic) {
        return 2.0 * u;
    }
    float g = abs(scene.g);
    float q = (1.0 - g) / (1.0 - g + 2.0 * g * u);
    return min(2.0 * (1.0 - u) * (1.0 + g * u) * q * q, 2.0);
}

// Duff et al., "Building an Orthonormal Basis, Revisited" (JCGT 2017).
mat3 basis_around(vec3 n) {
    float s = n.z >= 0.0 ? 1.0 : -1.0;
    float a = -1.0 / (s + n.z);
    float b = n.x * n.y * a;
    return mat3(vec3(1.0 + s * n.x * n.x * a, s * b, -s * n.x), vec3(b, s + n.y * n.y * a, -n.y), n);
}

// The direction at an angle from the axis; `u` in [0, 1) is its azimuth, as a share of a full circle.
vec3 direction_at(vec3 axis, float cosine, float sine, float u) {
    float phi = 2.0 * PI * u;
    return normalize(basis_around(axis) * vec3(sine * cos(phi), sine * sin(phi), cosine));
}

vec3 direction_around(vec3 axis, float cosine, float u) {
    return direction_at(axis, cosine, sqrt(max(0.0, 1.0 - cosine * cosine)), u);
}

// The direction at x from the lobe's axis; `u` as above.
vec3 scattered_direction(vec3 before, float x, float u) {
    float cosine = is_anisotropic && scene.g < 0.0 ? x - 1.0 : 1.0 - x;
    return direction_at(before, cosine, sqrt(x * (2.0 - x)), u);
}

// A direction from the whole sphere.
vec3 uniform_direction(vec2 u) {
    return direction_around(vec3(0.0, 0.0, 1.0), 1.0 - 2.0 * u.x, u.y);
}
