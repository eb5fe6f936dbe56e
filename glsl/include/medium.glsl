// The participating medium at a stored value or at a point: extinction and single-scattering albedo. The transfer
// function gives both: it is piecewise linear over stored values and constant beyond the ends; of two points at one
// value, V ≥ value takes the second.

#include "scene.glsl"
#include "volume.glsl"

// The transfer function has a column for each point: value, 1 / (distance to the next value), opacity, the next
// point's opacity; below it the colour and, in a, the integral of opacity over values up to the point; below that the
// integral of opacity times colour. The last point stands twice. The last row has a column for each bin of values:
// the first point that matters in it, and how many do (src/render/parts/transfer_table.rs). (An image and not a
// buffer: lavapipe reads buffers thread by thread.)
LOADED_AS(rgba32f) uniform texels2D transfer;

vec4 transfer_values(int point) {
    return texel_at(transfer, ivec2(point, 0));
}

vec3 transfer_colors(int point) {
    return texel_at(transfer, ivec2(point, 1)).rgb;
}

// The point from which to interpolate to the next one: the last with value ≤ v, or the first if there is none. Beyond
// the last segment interpolation stays at its end.
int transfer_point(float v) {
    float bin = clamp((v - scene.transfer_bins.x) * scene.transfer_bins.y, 0.0, float(TRANSFER_BINS - 1));
    vec2 candidates = texel_at(transfer, ivec2(bin, 3)).rg;
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

const vec2 ANY_VALUE = vec2(-LARGEST, LARGEST);

// The field's value at an end of a step, classified by the transfer function.
struct Classified {
    float value;
    int point; // from which to interpolate to the next; -1 below the first, the last one beyond it
    vec4 color; // and opacity in a
    vec4 area; // integral over values up to this one of opacity times colour and, in a, of opacity
    vec2 segment; // the values around this one between which the function is linear
    vec2 opacities; // at these values
};

// Means of opacity times colour and, in a, of opacity between two values, if both opacity and colour are linear from
// one to the other.
vec4 mean_of_line(vec4 a, vec4 b) {
    if (has_one_color) {
        return vec4(0.0, 0.0, 0.0, 0.5 * (a.a + b.a));
    }
    return vec4((a.a * (2.0 * a.rgb + b.rgb) + b.a * (a.rgb + 2.0 * b.rgb)) * (1.0 / 6.0), 0.5 * (a.a + b.a));
}

Classified classify(float v) {
    if (is_linear) {
        return Classified(v, 0, vec4(scene.color, transfer_opacity(v)), vec4(0.0), ANY_VALUE, vec2(0.0));
    }
    int point = transfer_point(v);
    vec4 p = transfer_values(point);
    float place = (v - p.x) * p.y;
    float t = clamp(place, 0.0, 1.0);
    vec4 here = texel_at(transfer, ivec2(point, 1));
    vec4 start = vec4(scene.color, p.z);
    vec4 color = vec4(scene.color, mix(p.z, p.w, t));
    vec4 area = vec4(vec3(0.0), here.a);
    if (!has_one_color) {
        start.rgb = here.rgb;
        color.rgb = mix(here.rgb, transfer_colors(point + 1), t);
        area.rgb = texel_at(transfer, ivec2(point, 2)).rgb;
    }
    bool is_below = v < p.x;
    bool is_beyond = place >= 1.0 && point + 1 == int(scene.transfer_segments);
    float share = 1.0 / max(place, 1.0); // of the segment in what lies above its point
    area += (v - p.x) * mix(color.a * vec4(color.rgb, 1.0), mean_of_line(start, color), share);
    float next = p.x + 1.0 / p.y;
    vec2 segment = is_below ? vec2(ANY_VALUE.x, p.x) : is_beyond ? vec2(next, ANY_VALUE.y) : vec2(p.x, next);
    vec2 opacities = is_below ? p.zz : is_beyond ? p.ww : p.zw;
    return Classified(v, point + int(is_beyond) - int(is_below), color, area, segment, opacities);
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

// The medium's mean along a step between whose ends the field is linear, however narrow the transfer function's tents
// are: pre-integrated classification (Engel, Kraus and Ertl 2001).
Medium mean_medium(Classified a, Classified b) {
    const float LEAST_SHARE = 1e-4; // Of smaller differences between areas too few digits are left.
    vec4 mean = mean_of_line(a.color, b.color);
    float range = b.value - a.value;
    if (!is_linear && a.point != b.point && abs(range) > LEAST_SHARE * max(a.area.a, b.area.a)) {
        mean = clamp((b.area - a.area) / range, 0.0, 1.0); // rounding may leave the range
    }
    vec3 albedo = has_one_color ? scene.color : min(mean.rgb / max(mean.a, 1e-30), 1.0);
    return Medium(scene.density * mean.a, albedo);
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
