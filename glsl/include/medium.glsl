// The participating medium at a stored value or at a point: extinction and single-scattering albedo. The transfer
// function gives both: it is piecewise linear over stored values and constant beyond the ends; of two points at one
// value, V ≥ value takes the second.

// The transfer function has a column for each point: value, 1 / (distance to the next value), opacity, the next point's
// opacity; below it the colour. The last point stands twice. (An image and not a buffer: lavapipe reads buffers
// thread by thread.)
LOADED_AS(rgba32f) uniform texels2D transfer;

vec4 transfer_values(int point) {
    return texel_at(transfer, ivec2(point, 0));
}

vec3 transfer_colors(int point) {
    return texel_at(transfer, ivec2(point, 1)).rgb;
}

// From which point to interpolate to the next: the last one with value ≤ v; the first, if there is none.
// Beyond the last segment interpolation stays at its end.
int transfer_point(float v) {
    int point = 0;
    int points = int(scene.transfer_segments);
    while (points > 1) {
        int half_way = points >> 1;
        point += v >= transfer_values(point + half_way).x ? half_way : 0;
        points -= half_way;
    }
    return point;
}

float transfer_opacity(float v) {
    if (is_linear) {
        return max(0.0, scene.linear_opacity.x + v * scene.linear_opacity.y); // rounding may leave the range
    }
    vec4 p = transfer_values(transfer_point(v));
    return mix(p.z, p.w, clamp((v - p.x) * p.y, 0.0, 1.0));
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

// The largest extinction over a range of stored values. It is exact for non-monotone transfer functions, too: a
// piecewise-linear function has its maximum at one of its points or at an end of the range.
float largest_sigma_t(vec2 range) {
    // Interpolation rounds: it may leave the voxels' range by some of their last digits.
    float rounding = 1e-6 * max(abs(range.x), abs(range.y));
    range += vec2(-rounding, rounding);
    float opacity = max(transfer_opacity(range.x), transfer_opacity(range.y));
    for (int i = 0; i < size_in_texels(transfer).x; ++i) {
        vec4 point = transfer_values(i);
        if (point.x >= range.x && point.x <= range.y) {
            opacity = max(opacity, point.z);
        }
    }
    return scene.density * opacity;
}
