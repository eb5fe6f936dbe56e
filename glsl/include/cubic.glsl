// Cubic polynomials c(u) = c.x + u·(c.y + u·(c.z + u·c.w)) on [0, 1]: along a ray, the field of a trilinear cell is one.

#include "loop.glsl"
#include "volume.glsl"

float evaluate(vec4 c, float u) {
    return c.x + u * (c.y + u * (c.z + u * c.w));
}

// The cubic's extrema, sorted and clamped to [0, 1]: between them it is monotone. The roots of c′ = y + 2zu + 3wu² are
// q/(3w) and y/q with q = −(z + sign(z)·√(z² − 3wy)), in which nothing cancels (Press et al., Numerical Recipes, 5.6).
vec2 extrema(vec4 c) {
    vec3 slope = in_own_unit(c.yzw);
    float a = 3.0 * slope.z;
    float b = slope.y;
    float discriminant = b * b - a * slope.x;
    if (discriminant < 0.0) {
        return vec2(1.0);
    }
    float q = -(b + (b < 0.0 ? -1.0 : 1.0) * sqrt(discriminant));
    float one = a != 0.0 ? q / a : 1.0;
    float two = q != 0.0 ? slope.x / q : 1.0;
    return clamp(vec2(min(one, two), max(one, two)), 0.0, 1.0);
}

// The root is refined to this fraction of a cell, the rounding of 32-bit floats; MOST_ROUNDS exceeds the 24 bisections that
// this takes.
const float ROOT_ERROR = 1e-7;
const int MOST_ROUNDS = 40;

// The root in [low, high], where c(u) ≥ 0 holds at `low` alone if `inside` is true, and at `high` alone if not: from the
// chord's root by Newton's method, kept within a bracket that shrinks by half where Newton would leave it (safeguarded
// Newton, ibid. 9.4).
float refine(vec4 c, float low, float high, bool inside) {
    float at_low = evaluate(c, low);
    float along_chord = at_low / (at_low - evaluate(c, high));
    bool has_chord = along_chord > 0.0 && along_chord < 1.0; // not where a sign was lost to rounding
    float u = mix(low, high, has_chord ? along_chord : 0.5);
    float error;
    int rounds = 0;
    LOOP {
        float value = evaluate(c, u);
        bool changed = (value >= 0.0) != inside;
        high = changed ? u : high;
        low = changed ? low : u;
        float next = u - value / (c.y + u * (2.0 * c.z + u * 3.0 * c.w));
        next = next > low && next < high ? next : 0.5 * (low + high);
        error = abs(next - u);
        u = next;
        ++rounds;
        if (error <= ROOT_ERROR || rounds == MOST_ROUNDS) {
            break;
        }
    }
    return u;
}

// Where the truth of c(u) ≥ 0 first differs from `inside`, for u ∈ (0, 1].
struct Change {
    bool exists;
    float low, high; // it does so between them, and the cubic is monotone there
};

Change first_change(vec4 c, bool inside) {
    vec2 split = extrema(c);
    bool in_first = (evaluate(c, split.x) >= 0.0) != inside;
    bool in_second = (evaluate(c, split.y) >= 0.0) != inside;
    bool in_third = (evaluate(c, 1.0) >= 0.0) != inside;
    return Change(in_first || in_second || in_third,
                  in_first ? 0.0 : in_second ? split.x : split.y,
                  in_first ? split.x : in_second ? split.y : 1.0);
}
