// Isosurfaces: where the truth of V ≥ value changes along a ray. In a trilinear cell the field along a ray is a
// cubic, so crossings are its exact roots (Marmitt et al. 2004).
//
// The ray carries its side of every surface as a bit, and a crossing is a change of truth against that bit. A sign
// lost to rounding at a cell's border is found in the next cell, so no ray slips through, and no epsilon is needed to
// leave a surface: its root there is divided out, and where the field goes from there tells the side. Only where a field touches
// the isovalue at voxels that have just that value, rounding is allowed for (`touches`).

#include "scene.glsl"
#include "cubic.glsl"
#include "loop.glsl"
#include "ranges.glsl"
#include "ray.glsl"
#include "volume.glsl"
#include "volume_bricks.glsl"

layout(scalar) readonly buffer SurfaceBlock { Surface at[]; } surfaces;

// Read once, as the scene's constants are; most scenes have a single surface.
Surface first_surface = surfaces.at[0];

Surface surface_at(uint index) {
    if (surface_count == 1u) {
        return first_surface;
    }
    return surfaces.at[index];
}

float isovalue(uint surface) {
    return surface == 0u ? first_surface.value : surfaces.at[surface].value;
}

float isovalue_rest(uint surface) {
    return surface == 0u ? first_surface.value_rest : surfaces.at[surface].value_rest;
}

struct Crossing {
    float t;
    int surface; // or NOTHING
    uint inside; // just before the crossing: bit s is V ≥ value of surface s
};

const Crossing NO_CROSSING = Crossing(0.0, NOTHING, 0u);

// Coefficients of the cell's field along p(u) = a + u·e, u ∈ [0, 1].
vec4 cell_cubic(Cell k, vec3 a, vec3 e) {
    float x = k.x + a.y * (k.xy + a.z * k.xyz) + a.z * k.xz;
    float y = k.y + a.z * (k.yz + a.x * k.xyz) + a.x * k.xy;
    float z = k.z + a.x * (k.xz + a.y * k.xyz) + a.y * k.yz;
    float xy = k.xy + a.z * k.xyz;
    float yz = k.yz + a.x * k.xyz;
    float xz = k.xz + a.y * k.xyz;
    return vec4(volume_interpolate(k, a),
                x * e.x + y * e.y + z * e.z,
                xy * e.x * e.y + yz * e.y * e.z + xz * e.x * e.z,
                k.xyz * e.x * e.y * e.z);
}

// origin + t·step − cell with the digits that the subtraction would lose (two-sum).
vec3 local_position(Ray ray, float t, vec3 cell) {
    precise vec3 high = ray.origin - cell;
    precise vec3 back = high - ray.origin;
    precise vec3 low = (ray.origin - (high - back)) + (-cell - back);
    precise vec3 along = fma(vec3(t), ray.step, high);
    return along + low;
}

// A part of a ray in a trilinear cell.
struct Passage {
    Corners corners;
    ivec3 cell;
    float t0, t1;
    int start_surface; // on which the ray starts at t0, or NOTHING
    bool fresh; // the sides are not known yet, which a ray that starts on a surface does know
    int crossed; // the first surface in their order that the ray crosses here, or NOTHING as far as is known
};

// More than the rounding of a position on a ray, in voxels.
float position_error(Ray ray, float t) {
    vec3 farthest = abs(ray.origin) + t * abs(ray.step);
    return exp2(-21.0) * max(farthest.x, max(farthest.y, farthest.z));
}

// The share of a cell's range of values by which a field that touches an isovalue is raised: more than the cubic's rounding.
const float RAISED_BY = exp2(-21.0);
// The raised field is the isovalue so close to a side of the cell, except where it is flat.
const float NEAR_A_SIDE = 1e-4;

// The first u ∈ [0, 1] of a passage at which it crosses the surface; > 1 if there is none. Unless `exactly`, the
// beginning of the interval in which the crossing lies.
float change_of(Ray ray, Passage passage, uint surface, bool exactly, inout uint inside) {
    float value = isovalue(surface);
    uint bit = 1u << surface;
    Cell relative = cell_of(passage.corners);
    precise float above = relative.c - value; // exact for integers, and here the digits are needed
    precise float above_exactly = above - isovalue_rest(surface);
    vec2 range = corner_range(passage.corners);
    // Where the isovalue is that of the cell's largest voxels, as in a mask, the field only touches it, at sides of the cell, and
    // rounding alone would tell whether a ray meets a structure that is a voxel thin.
    bool touches = range.y == value;
    relative.c = above_exactly + (touches ? RAISED_BY * (range.y - range.x) : 0.0);
    vec3 a = local_position(ray, passage.t0, vec3(passage.cell));
    vec4 c = cell_cubic(relative, a, ray.step * (passage.t1 - passage.t0));
    bool starts_here = int(surface) == passage.start_surface;
    if (passage.fresh) {
        inside = c.x >= 0.0 ? inside | bit : inside & ~bit;
    }
    bool is_inside = (inside & bit) != 0u;
    // Where a ray has just crossed one surface and is on the wrong side of another, both are at one place, as far as 32 bits
    // tell. If the side alone decided, the ray might cross them in turns without end.
    bool is_same_place = !starts_here && passage.start_surface >= 0 && (c.x >= 0.0) != is_inside;
    if (is_same_place && (c.y >= 0.0) != is_inside) {
        return 0.0;
    }
    starts_here = starts_here || is_same_place;
    if (starts_here) {
        c = vec4(c.yzw, 0.0);
    }
    if (!starts_here && (range.x >= value || range.y < value)) {
        return (range.x >= value) != is_inside ? 0.0 : 2.0;
    }
    if (touches && !starts_here && !is_inside && c.x >= 0.0) {
        return 0.0; // the previous passage ended before the side of the cell, by rounding
    }
    Change change = first_change(c, is_inside);
    if (!change.exists) {
        return 2.0;
    }
    if (!exactly) {
        return change.low;
    }
    float u = refine(c, change.low, change.high, is_inside);
    return touches && abs(u - round(u)) > NEAR_A_SIDE ? round(u) : u;
}

// Whether the passage crosses any surface.
bool crosses(Ray ray, inout Passage passage, inout uint inside) {
    iterations += 4u * surface_count;
    for (uint s = 0u; s < surface_count; ++s) {
        bool is_crossed = change_of(ray, passage, s, false, inside) <= 1.0;
        passage.crossed = is_crossed && passage.crossed < 0 ? int(s) : passage.crossed;
    }
    return passage.crossed >= 0;
}

// Finds the first crossing in a passage that has one; the sides are known. A compiler may round the same polynomials
// otherwise here than where the crossing was found. If that loses it, it is at the passage's end.
void find_in(Ray ray, Passage passage, inout Crossing crossing) {
    passage.fresh = false;
    float nearest = 1.0;
    crossing.surface = passage.crossed;
    for (uint s = 0u; s < surface_count; ++s) {
        float u = change_of(ray, passage, s, true, crossing.inside);
        if (u < nearest) {
            nearest = u;
            crossing.surface = int(s);
        }
    }
    crossing.t = mix(passage.t0, passage.t1, nearest);
}

// Whether a ray may cross a surface where the field takes values in `range`.
bool may_cross(vec2 range, uint inside, bool fresh) {
    bool any = false;
    for (uint s = 0u; s < surface_count; ++s) {
        float value = isovalue(s);
        bool truth = range.x >= value;
        bool changes = range.x < value && range.y >= value;
        any = any || changes || !fresh && truth != ((inside >> s & 1u) != 0u);
    }
    return any;
}

uint inside_of_range(vec2 range) {
    uint inside = 0u;
    for (uint s = 0u; s < surface_count; ++s) {
        inside |= range.x >= isovalue(s) ? 1u << s : 0u;
    }
    return inside;
}

// On which side of the surfaces a point is, in two bits: the number of surfaces that it is inside of, modulo 4. So the two
// sides of a surface always differ.
uint side_of_surfaces(uint inside) {
    return uint(bitCount(inside)) & 3u;
}

// A search for crossings along a ray, which has come to t.
struct Search {
    float t;
    ivec3 macrocell; // at t
    int start_surface; // as in Passage
    bool fresh;      // the same; otherwise `inside` is known
    uint inside;
};

ivec3 macrocell_at(Ray ray, float t) {
    return cell_at(ray, t, float(MACROCELL), ivec3(scene.macrocells));
}

// A ray that starts on a surface has its sides of all surfaces in `inside`. Of any other the search finds them.
Search begin_search(Ray ray, float t, int start_surface, uint inside) {
    return Search(t, macrocell_at(ray, t), start_surface, start_surface < 0, inside);
}

// Whether a ray crosses a surface between search.t and t_end, and in which passage first. Cells without a crossing are
// passed in a loop of their own: threads then solve cubics together.
bool cross_cells(Ray ray, inout Search search, float t_end, inout Passage passage) {
    ivec3 cells = ivec3(scene.dims) + 1;
    float t = search.t;
    Walk walk = begin_walk(ray, t, 1.0, cells);
    bool found;
    LOOP {
        bool more, may;
        LOOP {
            passage = Passage(volume_corners(walk.cell), walk.cell, t, max(t, min(walk.exit, t_end)),
                              search.start_surface, search.fresh, NOTHING);
            t = passage.t1;
            // A ray that has just met a side of this cell, and is beyond it but for rounding, does not meet it again.
            vec3 length = (t - passage.t0) * abs(ray.step);
            bool is_empty = search.start_surface >= 0 && max(length.x, max(length.y, length.z)) < position_error(ray, t);
            may = t > passage.t0 && !is_empty
               && (search.start_surface >= 0 || search.fresh
                   || may_cross(corner_range(passage.corners), search.inside, false));
            more = walk.exit < t_end && step_walk(walk, ray, 1.0, cells);
            if (may || !more || is_void) {
                break;
            }
        }
        found = may && crosses(ray, passage, search.inside);
        search.start_surface = may ? NOTHING : search.start_surface;
        search.fresh = search.fresh && !may;
        if (found || !more || is_void) {
            break;
        }
    }
    return found && !is_void;
}

// The first crossing from search.t to t_end. Cells are searched along the ray's part in a row of macrocells, and the
// root is refined at the end, so that threads wait for each other less often. If a brick is missing, the search stays
// in front of the row that needs it.
Crossing find_crossing(Ray ray, float t_end, inout Search search) {
    const uint MACROCELLS_PER_ROW = 2u;
    ivec3 macrocells = ivec3(scene.macrocells);
    Walk walk = walk_from(ray, search.macrocell, float(MACROCELL));
    bool more = search.t < t_end;
    Passage passage;
    bool found;
    LOOP {
        Search before = search;
        float exit = search.t;
        uint searched = 0u;
        LOOP {
            vec2 range = macrocell_range(walk.cell);
            bool is_first = searched == 0u;
            bool may = is_first && search.start_surface >= 0 || may_cross(range, search.inside, search.fresh || !is_first);
            if (!more || !is_first && !may) {
                break;
            }
            exit = max(exit, min(walk.exit, t_end));
            if (may) {
                ++searched;
            } else {
                search.inside = search.fresh ? inside_of_range(range) : search.inside;
                search.fresh = false;
                search.t = exit;
            }
            more = walk.exit < t_end && step_walk(walk, ray, float(MACROCELL), macrocells);
            if (!more || searched == MACROCELLS_PER_ROW) {
                break;
            }
        }
        found = searched > 0u && cross_cells(ray, search, exit, passage);
        search.t = exit;
        search.macrocell = walk.cell;
        if (is_void) {
            search = before;
        }
        if (found || !more || is_void) {
            break;
        }
    }
    Crossing crossing = Crossing(t_end, NOTHING, search.inside);
    if (found) {
        find_in(ray, passage, crossing);
    }
    return crossing;
}

// Continues behind a crossing.
void pass_through(Ray ray, Crossing crossing, inout Search search) {
    uint inside = crossing.inside ^ 1u << crossing.surface;
    search = Search(crossing.t, macrocell_at(ray, crossing.t), crossing.surface, false, inside);
}

// Multiplies `transmittance` by 1 − opacity of each crossing from search.t to t_end.
void attenuate(Ray ray, float t_end, inout Search search, inout float transmittance) {
    LOOP {
        Crossing crossing = find_crossing(ray, t_end, search);
        if (crossing.surface < 0) {
            break;
        }
        transmittance *= 1.0 - surface_at(uint(crossing.surface)).opacity;
        if (transmittance <= 0.0) {
            break;
        }
        pass_through(ray, crossing, search);
    }
}

// Product of 1 − opacity over the crossings of `ray` in [t, t_end].
float surface_transmittance(Ray ray, float t, float t_end, int start_surface, uint inside) {
    Search search = begin_search(ray, t, start_surface, inside);
    float transmittance = 1.0;
    attenuate(ray, t_end, search, transmittance);
    return transmittance;
}

struct Hit {
    vec3 geometric_normal; // unit, facing the arriving ray
    vec3 shading_normal;   // unit, facing the arriving ray
};

// The cosine by which a surface takes light from a direction: none from behind the surface itself, whatever its shading
// normal.
float cosine_towards(Hit hit, vec3 direction) {
    return dot(hit.geometric_normal, direction) > 0.0 ? max(0.0, dot(hit.shading_normal, direction)) : 0.0;
}

// The interpolant's gradient at a crossing, times ±1 so that it points to where the ray came from. Where the isovalue is that of
// many voxels side by side, as in a mask, a crossing lies on the side of a cell beyond which the field is constant or turns back:
// the gradient is that of the cell in which it does neither.
vec3 gradient_at(Ray ray, vec3 g, float towards_ray) {
    vec3 gradient = towards_ray * volume_gradient(g);
    if (!(dot(gradient, ray.direction) < 0.0)) {
        // Of a voxel, and beyond the rounding of g.
        vec3 beside = sign(ray.step) * max(vec3(1e-3), 5e-7 * abs(g));
        vec3 before = towards_ray * volume_gradient(g - beside);
        gradient = dot(before, ray.direction) < 0.0 ? before : towards_ray * volume_gradient(g + beside);
    }
    return gradient;
}

// Normals at a crossing of surface s. They point to where the ray came from: down the gradient if it
// came from outside, up it from inside.
Hit hit_at(Ray ray, Crossing crossing) {
    vec3 g = ray.origin + crossing.t * ray.step;
    bool from_inside = (crossing.inside >> crossing.surface & 1u) != 0u;
    float towards_ray = from_inside ? 1.0 : -1.0;
    vec3 gradient = in_own_unit(gradient_at(ray, g, towards_ray));
    float size = length(gradient);
    Hit hit;
    hit.geometric_normal = size > 0.0 ? gradient / size : -ray.direction;
    hit.shading_normal = hit.geometric_normal;
    if (!analytic_normals) {
        iterations += 8u;
        vec3 smoothed = in_own_unit(towards_ray * volume_smooth_gradient(g));
        float smooth_size = length(smoothed);
        if (smooth_size > 0.0 && dot(smoothed, ray.direction) < 0.0) {
            hit.shading_normal = smoothed / smooth_size;
        }
    }
    return hit;
}
