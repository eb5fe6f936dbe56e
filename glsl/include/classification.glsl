// The medium's mean along a step of a march: pre-integrated classification (Engel, Kraus and Ertl 2001), with what the bend of the
// field adds to it. The field's values at both ends of the step are classified by the transfer function.

#include "scene.glsl"
#include "medium.glsl"

const vec2 ANY_VALUE = vec2(-LARGEST, LARGEST);

// The field's value at an end of a step, classified by the transfer function.
struct Classified {
    float value;
    int point; // from which to interpolate to the next; -1 below the first, the last one beyond it
    vec4 color; // and opacity in a
    vec4 area; // integral over values from the middle point to this one of opacity times colour and, in a, of opacity
    vec2 segment; // the values around this one between which the function is linear
    vec4 low, high; // colour and opacity at these values
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
        return Classified(v, 0, vec4(scene.color, transfer_opacity(v)), vec4(0.0), ANY_VALUE, vec4(0.0), vec4(0.0));
    }
    int point = transfer_point(v);
    vec4 p = transfer_values(point);
    float along = (v - p.x) * p.y;
    float t = clamp(along, 0.0, 1.0);
    vec4 here = texel_at(transfer, ivec2(point, TRANSFER_COLORS));
    vec4 start = vec4(scene.color, p.z);
    vec4 color = vec4(scene.color, mix(p.z, p.w, t));
    vec4 area = vec4(vec3(0.0), here.a);
    vec4 next = vec4(scene.color, p.w);
    if (!has_one_color) {
        start.rgb = here.rgb;
        next.rgb = transfer_colors(point + 1);
        color.rgb = mix(start.rgb, next.rgb, t);
        area.rgb = texel_at(transfer, ivec2(point, TRANSFER_INTEGRALS)).rgb;
    }
    bool is_below = v < p.x;
    bool is_beyond = along >= 1.0 && point + 1 == int(scene.transfer_segments);
    // The fraction of [p.x, v] that lies on the segment; beyond its end the function is constant.
    float share = 1.0 / max(along, 1.0);
    area += (v - p.x) * mix(color.a * vec4(color.rgb, 1.0), mean_of_line(start, color), share);
    float next_value = p.y > 0.0 ? p.x + 1.0 / p.y : LARGEST;
    vec2 segment = is_below ? vec2(ANY_VALUE.x, p.x) : is_beyond ? vec2(next_value, ANY_VALUE.y) : vec2(p.x, next_value);
    vec4 low = is_beyond ? next : start;
    vec4 high = is_below ? start : next;
    return Classified(v, point + int(is_beyond) - int(is_below), color, area, segment, low, high);
}

// Whether the transfer function has points between two values.
bool has_points(Classified begin, Classified end) {
    return begin.point != end.point;
}

// Means of opacity times colour and, in a, of opacity along a step between whose ends the field is linear, however narrow the
// transfer function's tents are.
vec4 mean_between(Classified a, Classified b) {
    const float LEAST_SHARE = 1e-4; // Of smaller differences between areas too few digits are left.
    vec4 mean = mean_of_line(a.color, b.color);
    float range = b.value - a.value;
    if (!is_linear && has_points(a, b) && abs(range) > LEAST_SHARE * max(abs(a.area.a), abs(b.area.a))) {
        mean = clamp((b.area - a.area) / range, 0.0, 1.0); // rounding may leave the range
    }
    return mean;
}

// The medium that has these means along a step.
Medium mean_medium(vec4 mean) {
    vec3 albedo = has_one_color ? scene.color : min(mean.rgb / max(mean.a, 1e-30), 1.0);
    return Medium(scene.density * mean.a, albedo);
}

// The parts at the ends of a step over points of the transfer function: the first part ends at the point that comes first, and
// the last part begins at the last one. A step without points has a first part alone.
struct StepEnds {
    vec2 lengths;     // of the first and the last part, as shares of the step
    vec4 first, last; // colour and opacity where the first part ends and the last one begins
};

const vec2 ONE_PART = vec2(1.0, 0.0);

StepEnds step_ends_between(Classified begin, Classified end) {
    if (!has_points(begin, end)) {
        return StepEnds(ONE_PART, end.color, end.color);
    }
    bool rises = end.value > begin.value;
    vec2 points = rises ? vec2(begin.segment.y, end.segment.x) : vec2(begin.segment.x, end.segment.y);
    float range = abs(end.value - begin.value);
    vec2 lengths = abs(points - vec2(begin.value, end.value)) / (range > 0.0 ? range : LARGEST);
    return StepEnds(clamp(lengths, 0.0, 1.0), rises ? begin.high : begin.low, rises ? end.low : end.high);
}

// `color` premultiplied by its opacity, which stays in a.
vec4 product(vec4 color) {
    return vec4(color.a * color.rgb, color.a);
}

// The mean of 4x(1 − x) between two shares of a step.
float mean_bend(float x0, float x1) {
    return 2.0 * (x0 + x1) - (4.0 / 3.0) * (x0 * x0 + x0 * x1 + x1 * x1);
}

// The means of a step, which are `mean` if the field is straight, and whose field is off a straight line by `bend` half way, as a
// parabola: at a share x of the step by 4·bend·x(1 − x). Within one segment of the transfer function, colour and opacity are
// off by that times their slopes, which is exact: the mean of x(1 − x) is 1/6, and that of its square 1/30. Over points, a
// part whose product rises by r adds r·bend/(field's rise) times the part's mean of 4x(1 − x), to first order in the bend.
vec4 mean_along_bend(vec4 mean, float bend, Classified begin, Classified end, StepEnds ends) {
    float range = begin.segment.y - begin.segment.x;
    vec4 off = bend * (begin.high - begin.low) / (range > 0.0 ? range : LARGEST);
    vec4 middle = 0.5 * (begin.color + end.color);
    vec4 within = vec4(
        (2.0 / 3.0) * (off.a * middle.rgb + middle.a * off.rgb) + (8.0 / 15.0) * off.a * off.rgb,
        (2.0 / 3.0) * off.a);
    float rise = end.value - begin.value;
    vec2 x = vec2(ends.lengths.x, 1.0 - ends.lengths.y);
    vec4 first = product(ends.first);
    vec4 last = product(ends.last);
    vec4 rises = mean_bend(0.0, x.x) * (first - product(begin.color))
               + mean_bend(x.x, x.y) * (last - first)
               + mean_bend(x.y, 1.0) * (product(end.color) - last);
    vec4 over_points = bend / (rise != 0.0 ? rise : LARGEST) * rises;
    return clamp(mean + (has_points(begin, end) ? over_points : within), 0.0, 1.0);
}
