// The transfer function: piecewise linear over stored values, constant beyond the ends; of two
// points at one value, V ≥ value takes the second.

layout(binding = 2, scalar) readonly buffer TransferBlock { TransferPoint at[]; } transfer;

// Between which points v lies: the last point with value ≤ v and the one after it.
struct Bracket {
    uint low, high;
    float t;
};

Bracket transfer_bracket(float v) {
    uint low = 0u;
    uint high = scene.transfer_points;
    while (low < high) {
        uint middle = (low + high) >> 1u;
        if (v >= transfer.at[middle].value) {
            low = middle + 1u;
        } else {
            high = middle;
        }
    }
    uint last = scene.transfer_points - 1u;
    Bracket b;
    b.low = max(low, 1u) - 1u;
    b.high = min(low, last);
    float span = transfer.at[b.high].value - transfer.at[b.low].value;
    b.t = span > 0.0 ? (v - transfer.at[b.low].value) / span : 0.0;
    return b;
}

float transfer_opacity(float v) {
    Bracket b = transfer_bracket(v);
    return mix(transfer.at[b.low].opacity, transfer.at[b.high].opacity, b.t);
}

vec3 transfer_color(float v) {
    Bracket b = transfer_bracket(v);
    return mix(transfer.at[b.low].color, transfer.at[b.high].color, b.t);
}

// Colour and, in a, opacity.
vec4 transfer_at(float v) {
    Bracket b = transfer_bracket(v);
    TransferPoint low = transfer.at[b.low];
    TransferPoint high = transfer.at[b.high];
    return mix(vec4(low.color, low.opacity), vec4(high.color, high.opacity), b.t);
}
