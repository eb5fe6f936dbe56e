// Differences from 1 that keep their digits where they are small.

// 1 − a·b for unit vectors.
float one_minus_dot(vec3 a, vec3 b) {
    vec3 difference = a - b;
    return 0.5 * dot(difference, difference);
}

// 1 − exp(−x)
float one_minus_exp(float x) {
    return x < 0.01 ? x * (1.0 - x * (0.5 - x * (1.0 / 6.0))) : 1.0 - exp(-x);
}
