// The steps of a march through the medium, front to back: Σ T·(1 − exp(−σt·Δ))·albedo·light.
//
// A step ends where the ray leaves a cell, or earlier after a fraction of a mean free path at the densest point
// nearby. Within a cell the field along a ray is a cubic, and nearly linear: its kinks are at the cells' sides. So the
// medium's mean between the field's values at both ends is nearly right, however narrow a tent of the transfer function is,
// and has no noise. What the field's bend adds to it is known to first order (`mean_along_bend`), and where it bends too much
// for that, a step is shorter (`straight_part`); where extinction is linear in the field, the mean is exact. (Steps of equal
// length across cells have a bias, and one sample at a random point in each step has much noise: `transport hard_cases::march`.)
//
// Near a place that is very dense (`is_dense`), a step is a quarter or half of a voxel long, and undone if its own optical
// depth turns out to be too large. Otherwise rays that pass such a place would make hundreds of steps in each voxel, and
// more in all than a CPU's driver lets them (`iterations` in loop.glsl).

#include "scene.glsl"
#include "classification.glsl"
#include "close_to_one.glsl"
#include "loop.glsl"
#include "medium.glsl"
#include "ray.glsl"
#include "tracking.glsl"
#include "volume.glsl"

const float OPTICAL_DEPTH_PER_STEP = 0.5;
const float OPTICAL_DEPTH_PER_LINEAR_STEP = 1.0;
// However dense the medium is, a step ends at a later t than it begins at, also far along the ray.
const float LEAST_VOXELS_PER_STEP = 1e-3;
const float LEAST_SHARE_PER_STEP = 2e-7;

// Half of the length, in voxels, below which a step is taken as straight in any field.
const float HALF_OF_STRAIGHT = 1e-3;

// Factor on the length of steps for a picture in motion: they are longer, or end at the sides of larger cells.
float step_scale = 1.0;

bool is_in_motion() {
    return step_scale != 1.0;
}

// A march under way, stretch by stretch: each is the part of the ray in a row of blocks that hold medium. (Stretches
// of one block leave lanes waiting for their neighbours; rows without a limit would be walked through for rays that
// soon are opaque.)
struct March {
    float t, t_end;
    Walk walk;      // through the majorants' blocks; stands behind the stretch
    bool inside;    // whether the walk is still in the blocks' lattice
    float exit;     // where the stretch ends
    bool goes_on;   // whether steps of the stretch are left, from t on
    float longest;  // length of its longest step, in world units
    float longest_now; // length of the next one, at most
    Walk cells;     // through the cells whose sides end steps; stands at t
    Classified end; // where the next step begins
};

const uint BLOCKS_PER_STRETCH = 8u;

ivec3 step_cells() {
    return ivec3(ceil((vec3(scene.dims) + 0.5) / step_scale)); // as far as the box's high faces
}

// Goes on to the next stretch, if there is one.
void next_stretch(Ray ray, inout March march) {
    ivec3 lattice = ivec3(scene.blocks);
    float majorant = 0.0;
    uint blocks = 0u;
    march.t = march.exit;
    LOOP {
        float here = majorant_of(march.walk.cell);
        float exit = max(march.exit, min(march.walk.exit, march.t_end));
        bool holds_medium = march.inside && here > 0.0 && exit > march.exit;
        if (blocks > 0u && !holds_medium) {
            break;
        }
        march.exit = exit;
        march.t = holds_medium ? march.t : exit;
        blocks += holds_medium ? 1u : 0u;
        majorant = max(majorant, here);
        march.inside = march.walk.exit < march.t_end
                    && step_walk(march.walk, ray, scene.block_size, lattice);
        if (!march.inside || blocks == BLOCKS_PER_STRETCH) {
            break;
        }
    }
    march.goes_on = blocks > 0u;
    float voxel = 1.0 / length(ray.step);
    float depth = is_linear && !is_in_motion() ? OPTICAL_DEPTH_PER_LINEAR_STEP : OPTICAL_DEPTH_PER_STEP;
    march.longest = step_scale * depth * max(1.0 / majorant, voxel / DENSE_DEPTH);
    march.cells = begin_walk(ray, march.t, step_scale, step_cells());
    march.longest_now = march.longest;
    if (march.goes_on) {
        march.end = classify(lookup(ray, march.t));
    }
}

March begin_march(Ray ray, float t, float t_end) {
    const Classified NONE = Classified(0.0, 0, vec4(0.0), vec4(0.0), ANY_VALUE, vec4(0.0), vec4(0.0));
    Walk walk = begin_walk(ray, t, scene.block_size, ivec3(scene.blocks));
    March march = March(t, t_end, walk, true, t, false, 0.0, 0.0, walk, NONE);
    next_stretch(ray, march);
    return march;
}

// A step of the march. Extinction is linear in its first part, up to the point of the transfer function that comes first, and
// in its last part, from the last point on. Between these parts, if there is anything, it is taken as constant. A step
// without such points has a first part alone.
struct MarchStep {
    float alpha;    // 1 − exp(−optical depth)
    vec3 albedo;    // of what it meets
    float t;        // where it begins
    float extent;   // along the ray
    vec2 parts;     // the first and the last part, as shares of the step
    vec2 depths;    // as shares of its optical depth
    vec2 slopes;    // of extinction: (its value at the part's end − that at its beginning) / (their sum)
};

// The mean distance of collisions in a step, if its optical depth is small. As a share of a part of the step, it is
// ∫₀¹ x(1 − s + 2sx) dx = ½ + s/6, with s the slope of extinction.
float mean_collision(MarchStep s) {
    float first = s.parts.x * (0.5 + s.slopes.x * (1.0 / 6.0));
    if (is_linear) {
        return s.t + s.extent * first;
    }
    float last = 1.0 - s.parts.y * (0.5 - s.slopes.y * (1.0 / 6.0));
    float between = 0.5 * (1.0 + s.parts.x - s.parts.y);
    float share = 1.0 - s.depths.x - s.depths.y;
    return s.t + s.extent * (s.depths.x * first + share * between + s.depths.y * last);
}

// Undoes a step whose optical depth is too large, and sets how long the next one may be.
void adapt(Ray ray, float from, Classified begin, inout March march, inout Medium medium) {
    float depth = step_scale * OPTICAL_DEPTH_PER_STEP;
    float shortest = max(LEAST_VOXELS_PER_STEP / length(ray.step), LEAST_SHARE_PER_STEP * from);
    bool is_undone = medium.sigma_t * (march.t - from) > depth && march.longest_now > shortest;
    float sigma_t = is_undone ? medium.sigma_t : scene.density * march.end.color.a;
    march.longest_now = clamp(0.5 * depth / max(sigma_t, 1e-30), shortest, march.longest);
    if (is_undone) {
        march.t = from;
        march.end = begin;
        medium.sigma_t = 0.0;
    }
}

// The part of a step, from its beginning on, in which the field is so straight that the medium's mean can be taken between the
// values at its ends. `middle` is the value half way. How far a part of a curve is off a straight line falls with the square
// of that part. The caller ends this where a field is so steep, as beside a number for missing values, that no part of a step is
// straight.
float straight_part(Classified begin, Classified end, float middle) {
    const float LEAST = 0.25;
    const float OFF = 0.05; // of a segment of the transfer function
    const float ROUNDING = 1e-6;
    float off = abs(middle - 0.5 * (begin.value + end.value));
    if (off < ROUNDING * max(abs(begin.value), abs(end.value))) {
        return 1.0;
    }
    if (!has_points(begin, end)) {
        // Within a segment, extinction is linear in the field.
        return middle >= begin.segment.x && middle <= begin.segment.y ? 1.0 : LEAST;
    }
    float between = abs(end.value - begin.value) / float(abs(end.point - begin.point));
    float width = min(between, min(begin.segment.y - begin.segment.x, end.segment.y - end.segment.x));
    return clamp(sqrt(OFF * width / off), LEAST, 1.0);
}

// The medium's mean in [from, march.t], which lies in one cell: a read of it tells the field at its ends and half way. (In motion
// it may lie in two; then the one at its end is read, and the field is taken as straight.) Where the field is not straight
// enough, march.t becomes the end of the first part that is. `step_ends` says how points divide the step.
//
// There is no branch that depends on values, because a CPU's driver runs both sides of one. A loop has a second iteration
// only where a lane needs it.
Medium medium_in_step(Ray ray, float from, inout Classified begin, inout March march, out StepEnds step_ends) {
    vec3 end = ray.origin + march.t * ray.step;
    vec3 middle = ray.origin + 0.5 * (from + march.t) * ray.step;
    vec3 half_way = 0.5 * (march.t - from) * ray.step;
    vec3 cell = floor(is_in_motion() ? end : middle);
    Corners corners = corners_read(ivec3(cell));
    float middle_value = value_in(corners, middle - cell);
    if (is_linear) {
        march.end = classify(value_in(corners, end - cell));
        Classified first = classify(value_in(corners, middle - cell - half_way));
        begin.color.a = is_in_motion() ? begin.color.a : first.color.a;
        float ends = begin.color.a + march.end.color.a;
        // Extinction is linear in the field, and so a cubic in t, whose mean Simpson's rule gives exactly.
        float mean = is_in_motion() ? 0.5 * ends : (ends + 4.0 * transfer_opacity(middle_value)) * (1.0 / 6.0);
        step_ends = StepEnds(ONE_PART, march.end.color, march.end.color);
        return Medium(scene.density * mean, scene.color);
    }
    float part = 1.0;
    bool is_straight = is_in_motion() || dot(half_way, half_way) < HALF_OF_STRAIGHT * HALF_OF_STRAIGHT;
    LOOP {
        march.end = classify(value_in(corners, end - cell + 2.0 * (part - 1.0) * half_way));
        float straight = straight_part(begin, march.end, middle_value);
        if (is_straight || straight >= 1.0) {
            break;
        }
        part = straight;
        is_straight = true;
    }
    march.t = from + part * (march.t - from);
    // Through rounding, the previous step may have ended just off a plateau's value, on the other side of a discontinuity of
    // the transfer function: both ends of this step get the plateau's class.
    bool begins_in_cell = !is_in_motion() || all(lessThan(abs(middle - cell - half_way - 0.5), vec3(0.501)));
    if (begins_in_cell && is_plateau(corners)) {
        begin.point = march.end.point;
        begin.color = march.end.color;
    }
    step_ends = step_ends_between(begin, march.end);
    vec4 mean = mean_between(begin, march.end);
    if (!is_in_motion()) {
        float chord = 0.5 * (begin.value + march.end.value);
        float bend = value_in(corners, middle - cell + (part - 1.0) * half_way) - chord;
        mean = mean_along_bend(mean, bend, begin, march.end, step_ends);
    }
    return mean_medium(mean);
}

MarchStep make_step(Ray ray, inout March march) {
    Classified begin = march.end;
    float from = march.t;
    float most = min(from + march.longest_now, march.exit);
    march.t = max(from, min(march.cells.exit, most));
    StepEnds step_ends;
    Medium medium = medium_in_step(ray, from, begin, march, step_ends);
    if (is_dense) {
        adapt(ray, from, begin, march, medium);
    }
    march.goes_on = march.t < march.exit;
    if (march.cells.exit <= march.t) {
        step_walk(march.cells, ray, step_scale, step_cells());
    }
    MarchStep s;
    s.extent = march.t - from;
    s.alpha = one_minus_exp(medium.sigma_t * s.extent);
    s.albedo = medium.albedo;
    s.t = from;
    vec4 ends = vec4(begin.color.a, step_ends.first.a, step_ends.last.a, march.end.color.a);
    vec2 sums = ends.xz + ends.yw;
    vec2 depths = 0.5 * step_ends.lengths * sums / max(medium.sigma_t / scene.density, 1e-30);
    s.parts = step_ends.lengths;
    // Where nothing is between the two parts, they have all of the optical depth.
    float least = step_ends.lengths.x + step_ends.lengths.y < 1.0 - 1e-6 ? 1.0 : 1e-30;
    s.depths = step_ends.lengths.x < 1.0 ? depths / max(least, depths.x + depths.y) : ONE_PART;
    s.slopes = (ends.yw - ends.xz) / max(sums, 1e-30);
    return s;
}

// Positions in a part at given shares of its optical depth, where extinction is linear in x: τ(x)/τ = x + slope·(x² − x);
// the root in [0, 1], in the form that does not cancel.
vec4 position_in_part(float slope, vec4 share) {
    float begins = 1.0 - slope;
    return 2.0 * share / (begins + sqrt(max(begins * begins + 4.0 * slope * share, 0.0)) + 1e-30);
}

// Distances of collisions in a step for four numbers u in [0, 1): samples from the density T(x)·σt(x), by inverting
// u = (1 − exp(−τ(x))) / α with α = 1 − exp(−τ). The share τ(x)/τ = ln(1 − αu) / ln(1 − α) is, to second order in α,
// u − αu(1 − u)·(½ + α·(1 + 4u)/12).
vec4 sample_collisions(MarchStep s, vec4 u) {
    vec4 share = u - s.alpha * u * (1.0 - u) * (0.5 + s.alpha * (1.0 / 12.0) * (1.0 + 4.0 * u));
    if (is_linear) {
        return s.t + s.extent * position_in_part(s.slopes.x, share);
    }
    vec2 depths = max(s.depths, 1e-30);
    float behind = 1.0 - s.depths.y;
    vec4 first = s.parts.x * position_in_part(s.slopes.x, min(share / depths.x, 1.0));
    vec4 last = 1.0 - s.parts.y * (1.0 - position_in_part(s.slopes.y, max((share - behind) / depths.y, 0.0)));
    vec4 between = s.parts.x + (1.0 - s.parts.x - s.parts.y) * (share - s.depths.x) / max(behind - s.depths.x, 1e-30);
    vec4 position = mix(between, first, lessThan(share, vec4(s.depths.x)));
    return s.t + s.extent * mix(position, last, greaterThan(share, vec4(behind)));
}

// The transmittance of [t, t_end], or 0 where it is less than `least`.
float marched_transmittance(Ray ray, float t, float t_end, float least) {
    if (!has_medium || !(t < t_end)) {
        return 1.0;
    }
    March march = begin_march(ray, t, t_end);
    float transmittance = 1.0;
    LOOP {
        if (!march.goes_on) {
            break;
        }
        LOOP {
            MarchStep s = make_step(ray, march);
            transmittance *= 1.0 - s.alpha;
            if (!march.goes_on || transmittance < least) {
                break;
            }
        }
        if (transmittance < least) {
            break;
        }
        next_stretch(ray, march);
    }
    return transmittance < least ? 0.0 : transmittance;
}
