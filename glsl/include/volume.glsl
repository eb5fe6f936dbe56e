// The field V: the trilinear interpolant of the voxels, in stored values. Every read of the volume
// goes through this file. Positions are in grid space (src/render/shared.rs).

#include "scene.glsl"
#include "volume_bricks.glsl"

// EACH_VOLUME_IMAGE(DO) is DO(NAME, CONDITION) for each image that holds the volume, where CONDITION is whether the variable
// `image` is its number (src/render/volume_images.rs).
#define DECLARED(name, is_chosen) LOADED_AS(VOLUME_FORMAT) uniform texels3D name;
EACH_VOLUME_IMAGE(DECLARED)

// The exact stored value of a voxel's texel, which may represent an integer: the normalised formats hold k/255 and
// k/65535 only to rounding.
float stored_value(float texel) {
    return scene.stored_max == 1.0 ? texel : round(texel * scene.stored_max);
}

// The voxel's exact stored value, clamped at the border.
float volume_voxel(ivec3 voxel) {
    voxel = clamp(voxel, ivec3(0), ivec3(scene.dims) - 1);
    BrickPlace place = place_of_brick(voxel);
    int image = place.image;
    ivec3 at = voxel + place.to_texel;
    float texel;
#define VOXEL(name, is_chosen) if (is_chosen) { texel = texel_at(name, at).r; }
    EACH_VOLUME_IMAGE(VOXEL)
    return stored_value(texel);
}

// Texels at the corners of a trilinear cell, clamped at the border: x grows from component 0 to 1 and
// from 2 to 3, y from 01 to 23, z from `near` to `far`.
struct Corners {
    vec4 near, far;
};

Corners volume_corners(ivec3 cell) {
    ivec3 last = ivec3(scene.dims) - 1;
    ivec3 a = clamp(cell - 1, ivec3(0), last);
    ivec3 b = clamp(cell, ivec3(0), last);
    BrickPlace place = place_of_brick(a);
    int image = place.image;
    a += place.to_texel;
    b += place.to_texel;
    Corners corners;
#define CORNERS(name, is_chosen)                                                                \
    if (is_chosen) {                                                                            \
        corners = Corners(vec4(texel_at(name, a).r,                                             \
                               texel_at(name, ivec3(b.x, a.yz)).r,                              \
                               texel_at(name, ivec3(a.x, b.y, a.z)).r,                          \
                               texel_at(name, ivec3(b.xy, a.z)).r),                             \
                          vec4(texel_at(name, ivec3(a.xy, b.z)).r,                              \
                               texel_at(name, ivec3(b.x, a.y, b.z)).r,                          \
                               texel_at(name, ivec3(a.x, b.yz)).r,                              \
                               texel_at(name, b).r));                                           \
    }
    EACH_VOLUME_IMAGE(CORNERS)
    return corners;
}

// The same as exact stored values.
Corners stored_values(Corners texels) {
    if (scene.stored_max == 1.0) {
        return texels;
    }
    return Corners(round(texels.near * scene.stored_max), round(texels.far * scene.stored_max));
}

// Whether the field is constant in the cell.
bool is_plateau(Corners corners) {
    vec4 first = corners.near.xxxx;
    return corners.near == first && corners.far == first;
}

// Smallest and largest stored value.
vec2 corner_range(Corners corners) {
    vec4 least = min(corners.near, corners.far);
    vec4 most = max(corners.near, corners.far);
    return vec2(stored_value(min(min(least.x, least.y), min(least.z, least.w))),
                stored_value(max(max(most.x, most.y), max(most.z, most.w))));
}

// The trilinear cell floor(g) as a polynomial in the local position p ∈ [0, 1]³:
// V = c + x·p.x + y·p.y + z·p.z + xy·p.x·p.y + yz·p.y·p.z + xz·p.x·p.z + xyz·p.x·p.y·p.z.
struct Cell {
    float c, x, y, z, xy, yz, xz, xyz;
};

Cell cell_of(Corners corners) {
    Corners stored = stored_values(corners);
    vec4 n = stored.near;
    vec4 f = stored.far;
    Cell r;
    r.c = n.x;
    r.x = n.y - n.x;
    r.y = n.z - n.x;
    r.z = f.x - n.x;
    r.xy = (n.w - n.z) - (n.y - n.x);
    r.yz = (f.z - f.x) - (n.z - n.x);
    r.xz = (f.y - f.x) - (n.y - n.x);
    r.xyz = ((f.w - f.z) - (f.y - f.x)) - ((n.w - n.z) - (n.y - n.x));
    return r;
}

float volume_interpolate(Cell k, vec3 p) {
    return k.c + p.x * (k.x + p.y * (k.xy + p.z * k.xyz)) + p.y * (k.y + p.z * k.yz)
         + p.z * (k.z + p.x * k.xz);
}

// The stored value at the local position p in a cell. Where all corners are equal it is theirs, to the last bit, since a
// transfer function may have a step just there. So it is no mix, which rounds a·(1 − t) + a·t, and precise keeps a compiler
// from making one of it.
float value_in(Corners corners, vec3 p) {
    Corners stored = stored_values(corners);
    precise vec4 along_z = stored.near + p.z * (stored.far - stored.near);
    precise vec2 along_y = along_z.xy + p.y * (along_z.zw - along_z.xy);
    precise float value = along_y.x + p.x * (along_y.y - along_y.x);
    return value;
}

// The field's value V(g). Not by the device's filter, which rounds g (src/render/peak/filter_probe.rs).
float volume_value(vec3 g) {
    vec3 cell = floor(g);
    return value_in(volume_corners(ivec3(cell)), g - cell);
}

// A vector in the unit of its largest component. Values have the data's own unit, in which their squares may be beyond a
// float: densities are 1e-24 in g/cm³, and 1e20 in 1/m³.
vec3 in_own_unit(vec3 v) {
    float largest = max(max(abs(v.x), abs(v.y)), abs(v.z));
    return largest > 1e-37 ? v * (1.0 / largest) : v;
}

// The interpolant's gradient, times the largest voxel size: only its direction is of use, and with another unit of length
// it might be beyond a float.
vec3 volume_gradient(vec3 g) {
    vec3 cell = floor(g);
    Cell k = cell_of(volume_corners(ivec3(cell)));
    vec3 p = g - cell;
    return vec3(k.x + p.y * k.xy + p.z * (k.xz + p.y * k.xyz),
                k.y + p.x * k.xy + p.z * (k.yz + p.x * k.xyz),
                k.z + p.x * k.xz + p.y * (k.yz + p.x * k.xyz)) / in_own_unit(scene.spacing);
}

vec3 central_difference(ivec3 voxel) {
    const ivec2 step = ivec2(1, 0);
    return vec3(volume_voxel(voxel + step.xyy) - volume_voxel(voxel - step.xyy),
                volume_voxel(voxel + step.yxy) - volume_voxel(voxel - step.yxy),
                volume_voxel(voxel + step.yyx) - volume_voxel(voxel - step.yyx))
         / (2.0 * in_own_unit(scene.spacing));
}

// Central differences at voxels, interpolated trilinearly, in the same unit.
vec3 volume_smooth_gradient(vec3 g) {
    ivec3 low = ivec3(floor(g)) - 1;
    vec3 p = fract(g);
    vec3 sum = vec3(0.0);
    for (int corner = 0; corner < 8; ++corner) {
        ivec3 offset = ivec3(corner, corner >> 1, corner >> 2) & 1;
        vec3 weight = mix(1.0 - p, p, vec3(offset));
        ivec3 voxel = clamp(low + offset, ivec3(0), ivec3(scene.dims) - 1);
        sum += weight.x * weight.y * weight.z * central_difference(voxel);
    }
    return sum;
}
