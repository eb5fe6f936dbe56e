// The participating medium at a stored value or at a point: extinction and single-scattering albedo. The transfer
// function gives both: it is piecewise linear over stored values and constant beyond the ends; of two points at one
// value, V ≥ value takes the second.

#include "scene.glsl"
#include "volume.glsl"

// Rows and columns are those of `transfer_texels` (src/render/parts/transfer_table.rs). (An image and not a buffer:
// lavapipe reads buffers thread by thread.)
LOADED_AS(rgba32f) uniform texels2D transfer;

vec4 transfer_values(int point) {
    return texel_at(transfer, ivec2(point, TRANSFER_SEGMENTS));
}

vec3 transfer_colors(int point) {
    return texel_at(transfer, ivec2(point, TRANSFER_COLORS)).rgb;
}

// The point from which to interpolate to the next one: the last with value ≤ v, or the first if there is none. Beyond
// the last segment interpolation stays at its end.
int transfer_point(float v) {
    float bin = clamp((v - scene.transfer_bins.x) * scene.transfer_bins.y, 0.0, float(TRANSFER_BINS - 1));
    vec2 candidates = texel_at(transfer, ivec2(bin, TRANSFER_CANDIDATES)).rg;
    int point = int(candidates.x);
    int points = int(candidates.y);
    while (points > 1) {
        int half_way = points >> 1;
        point += v >= transfer_values(point + half_way).x ? half_way : 0;
        points -= half_way;
    }
    return point;
}

// Opacity at v, whose `transfer_point` is known.
float opacity_from(int point, float v) {
    if (is_linear) {
        vec3 line = scene.linear_opacity;
        return max(0.0, line.y + (v - line.x) * line.z); // rounding may leave the range
    }
    vec4 p = transfer_values(point);
    return mix(p.z, p.w, clamp((v - p.x) * p.y, 0.0, 1.0));
}

float transfer_opacity(float v) {
    return opacity_from(is_linear ? 0 : transfer_point(v), v);
}

// Colour and, in a, opacity.
vec4 transfer_at(float v) {
    if (is_linear) {
        return vec4(scene.color, transfer_opacity(v));
    }
    int point = transfer_point(v);
    vec4 p = transfer_values(point);
    float t = clamp((v - p.x) * p.y, 0.0, 1.0);
    if (has_one_color) {
        return vec4(scene.color, mix(p.z, p.w, t));
    }
    return vec4(mix(transfer_colors(point), transfer_colors(point + 1), t), mix(p.z, p.w, t));
}

struct Medium {
    float sigma_t; // extinction, per world unit
    vec3 albedo;   // σs/σt of each channel
};

// The medium where the field has the stored value v.
Medium medium_of(float v) {
    vec4 colored = transfer_at(v);
    return Medium(scene.density * colored.a, colored.rgb);
}

Medium medium_at(vec3 g) {
    return medium_of(volume_value(g));
}

float sigma_t_of(float v) {
    return scene.density * transfer_opacity(v);
}

vec3 albedo_of(float v) {
    return has_one_color ? scene.color : transfer_at(v).rgb;
}

// The smallest and the largest extinction between two stored values, low ≤ high. They are exact for non-monotone transfer
// functions, too: a piecewise-linear function has its extrema at its points or at the ends of the range.
vec2 sigma_t_between(float low, float high) {
    int first = is_linear ? 0 : transfer_point(low);
    int last = is_linear ? 0 : transfer_point(high);
    vec2 ends = vec2(opacity_from(first, low), opacity_from(last, high));
    vec2 opacity = vec2(min(ends.x, ends.y), max(ends.x, ends.y));
    for (int i = first + 1; i <= last; ++i) {
        float at_point = transfer_values(i).z;
        opacity = vec2(min(opacity.x, at_point), max(opacity.y, at_point));
    }
    return scene.density * opacity;
}

// The same for all values that interpolation can give where voxels are in a range.
vec2 sigma_t_range(vec2 range) {
    // Where all voxels are equal there is nothing to interpolate, and a background at which a ramp of opacity begins is
    // empty.
    float rounding = range.x < range.y ? INTERPOLATION_ROUNDING * max(abs(range.x), abs(range.y)) : 0.0;
    return sigma_t_between(range.x - rounding, range.y + rounding);
}

float largest_sigma_t(vec2 range) {
    return sigma_t_range(range).y;
}
