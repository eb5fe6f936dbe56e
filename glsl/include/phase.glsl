// Henyey–Greenstein; g > 0 is forward. Directions are those of travel, cosine = dot(before, after).

const float PI = 3.14159265358979;

float phase_function(float cosine) {
    if (!is_anisotropic) {
        return 0.25 / PI;
    }
    float g = scene.g;
    // 1 + g² − 2g·cosine without cancellation where g → 1 and cosine → 1, which rounding may exceed.
    float d = (1.0 - abs(g)) * (1.0 - abs(g)) + 2.0 * abs(g) * max(0.0, 1.0 - (g < 0.0 ? -cosine : cosine));
    return 0.25 / PI * (1.0 - g) * (1.0 + g) / (d * sqrt(d));
}

// Branch-free and stable through g = 0: the textbook inversion cancels for small g. It would cancel
// here for g near −1, but the distribution for −g is the mirror image.
float phase_sample_cosine(float u) {
    if (!is_anisotropic) {
        return 1.0 - 2.0 * u;
    }
    float g = abs(scene.g);
    float q = (1.0 - g) / (1.0 - g + 2.0 * g * u);
    float cosine = max(1.0 - 2.0 * (1.0 - u) * (1.0 + g * u) * q * q, -1.0);
    return scene.g < 0.0 ? -cosine : cosine;
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
