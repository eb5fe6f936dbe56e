//! The field V: the trilinear interpolant of the voxels, its gradients, and exactly where a ray
//! crosses a value.
//!
//! Grid coordinates put voxel (i, j, k) at the integer point (i, j, k), so a *cell* spans eight
//! voxels and V is one trilinear polynomial in it: a cubic along a ray. The cells numbered −1 and
//! n−1 are the outer half voxels: their missing voxels repeat the border ones, which is the clamping.

use glam::{DVec3, IVec3};
use isolume::scene::ClipPlane;
use isolume::scene::volume::{Volume, Voxels};
use std::{array, iter};

#[derive(Debug, Clone, Copy)]
pub struct Ray {
    pub origin: DVec3,
    /// Unit length.
    pub direction: DVec3,
}

impl Ray {
    pub fn at(&self, t: f64) -> DVec3 {
        self.origin + t * self.direction
    }
}

/// Where the truth of V ≥ value changes along a ray.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Crossing {
    pub t: f64,
    /// The cell's lowest corner, from −1 to n−1 along each axis.
    pub cell: IVec3,
    /// V ≥ value beyond it, not before it.
    pub entering: bool,
}

/// The stretch of a ray inside one cell.
#[derive(Debug, Clone, Copy)]
pub struct Segment {
    pub cell: IVec3,
    pub start: f64,
    pub end: f64,
}

/// A polynomial c0 + c1·s + c2·s² + c3·s³.
#[derive(Debug, Clone, Copy)]
pub struct Cubic(pub [f64; 4]);

/// The part of a ray with t ≥ 0 that lies inside the box and no clip plane's far side. Both are
/// half-spaces, so that this is one interval.
pub fn interval(volume: &Volume, clips: &[ClipPlane], ray: &Ray) -> Option<(f64, f64)> {
    let half = DVec3::from(volume.extent()) / 2.0;
    let faces = (0..3).flat_map(|a| [(DVec3::AXES[a], half[a]), (-DVec3::AXES[a], half[a])]);
    let clips = clips.iter().map(|c| (DVec3::from(c.normal), c.offset));
    let (mut t0, mut t1) = (0.0_f64, f64::INFINITY);
    for (normal, offset) in faces.chain(clips) {
        let rate = normal.dot(ray.direction);
        let room = offset - normal.dot(ray.origin);
        if rate > 0.0 {
            t1 = t1.min(room / rate);
        } else if rate < 0.0 {
            t0 = t0.max(room / rate);
        } else if room < 0.0 {
            return None;
        }
    }
    (t0 < t1).then_some((t0, t1))
}

pub fn value_at(volume: &Volume, point: DVec3) -> f64 {
    let (cell, local) = locate(volume, point);
    trilinear(corners(cell, voxels_of(volume)), local)
}

/// The interpolant's own gradient n_g, in world units.
pub fn gradient_analytic(volume: &Volume, point: DVec3) -> DVec3 {
    gradient_in_cell(volume, locate(volume, point).0, point)
}

/// n_g of the polynomial that belongs to `cell`: on a cell's face the neighbour's is another one.
pub fn gradient_in_cell(volume: &Volume, cell: IVec3, point: DVec3) -> DVec3 {
    let local = to_grid(volume, point) - cell.as_dvec3();
    let values = corners(cell, voxels_of(volume));
    let gradient = DVec3::from_array(array::from_fn(|a| {
        let (mut low, mut high) = (local, local);
        (low[a], high[a]) = (0.0, 1.0);
        trilinear(values, high) - trilinear(values, low)
    }));
    gradient / DVec3::from(volume.spacing)
}

/// Central differences at voxels in world units, interpolated trilinearly. Beyond the border the
/// border voxel repeats, and the distance is two voxels there, too.
pub fn gradient_smooth(volume: &Volume, point: DVec3) -> DVec3 {
    let (cell, local) = locate(volume, point);
    let voxel = voxels_of(volume);
    let difference = |at: IVec3, axis: usize| {
        let at = at.clamp(IVec3::ZERO, last_voxel(volume));
        let step = IVec3::AXES[axis];
        (voxel(at + step) - voxel(at - step)) / (2.0 * volume.spacing[axis])
    };
    DVec3::from_array(array::from_fn(|a| {
        trilinear(corners(cell, |v| difference(v, a)), local)
    }))
}

/// Crossings of V = value between t0 and t1, in order. `inside` is the truth of V ≥ value with which the ray begins, for a ray that
/// leaves this very surface; otherwise V at t0 decides.
pub fn crossings(
    volume: &Volume,
    value: f64,
    ray: Ray,
    t0: f64,
    t1: f64,
    inside: Option<bool>,
) -> impl Iterator<Item = Crossing> {
    let mut inside = inside;
    let voxel = voxels_of(volume);
    segments(volume, ray, t0, t1).flat_map(move |segment| {
        // V lies between the values at the cell's corners: where all are on the ray's side, nothing changes.
        let sides = corners(segment.cell, |v| voxel(v) >= value);
        let is_one_side = sides == [sides[0]; 8];
        let changes = if is_one_side && *inside.get_or_insert(sides[0]) == sides[0] {
            [None; 3]
        } else {
            let cubic = cubic_along(volume, &ray, &segment, value);
            let side = inside.get_or_insert(cubic.at(0.0) >= 0.0);
            cubic.sign_changes(segment.end - segment.start, side)
        };
        changes
            .into_iter()
            .flatten()
            .map(move |(s, entering)| Crossing {
                t: segment.start + s,
                cell: segment.cell,
                entering,
            })
    })
}

/// The cells along a ray, in order, without gaps.
pub fn segments(volume: &Volume, ray: Ray, t0: f64, t1: f64) -> impl Iterator<Item = Segment> {
    let origin = to_grid(volume, ray.origin);
    let rate = ray.direction / DVec3::from(volume.spacing);
    let last = last_voxel(volume);
    let start = origin + t0 * rate;
    let mut next_plane: [f64; 3] = array::from_fn(|a| {
        if rate[a] > 0.0 {
            start[a].floor() + 1.0
        } else {
            start[a].ceil() - 1.0
        }
    });
    let mut t = t0;
    iter::from_fn(move || {
        while t < t1 {
            let arrival: [f64; 3] = array::from_fn(|a| {
                if rate[a] == 0.0 {
                    f64::INFINITY
                } else {
                    (next_plane[a] - origin[a]) / rate[a]
                }
            });
            let axis = (0..3).min_by(|&a, &b| arrival[a].total_cmp(&arrival[b]))?;
            next_plane[axis] += rate[axis].signum();
            let (start, end) = (t, arrival[axis].min(t1));
            // A ray along an edge or through a corner meets several planes at once.
            if start < end {
                t = end;
                // The middle of the stretch is never in doubt about its cell.
                let middle = origin + 0.5 * (start + end) * rate;
                let cell = middle.floor().as_ivec3().clamp(IVec3::NEG_ONE, last);
                return Some(Segment { cell, start, end });
            }
        }
        None
    })
}

/// V − value along a segment, with s = 0 at its start.
pub fn cubic_along(volume: &Volume, ray: &Ray, segment: &Segment, value: f64) -> Cubic {
    let start = to_grid(volume, ray.at(segment.start)) - segment.cell.as_dvec3();
    let rate = ray.direction / DVec3::from(volume.spacing);
    let voxel = voxels_of(volume);
    let c = corners(segment.cell, |v| Cubic([voxel(v) - value, 0.0, 0.0, 0.0]));
    let mix = |low: Cubic, high: Cubic, axis: usize| low.mix(high, start[axis], rate[axis]);
    let row = |n: usize| mix(c[n], c[n + 1], 0);
    let face = |n: usize| mix(row(n), row(n + 2), 1);
    mix(face(0), face(4), 2)
}

impl Cubic {
    pub fn at(&self, s: f64) -> f64 {
        let [c0, c1, c2, c3] = self.0;
        c0 + s * (c1 + s * (c2 + s * c3))
    }

    /// self + (high − self)·(a + b·s), whose degree must not exceed three.
    fn mix(self, high: Cubic, a: f64, b: f64) -> Cubic {
        let d: [f64; 4] = array::from_fn(|n| high.0[n] - self.0[n]);
        Cubic(array::from_fn(|n| {
            self.0[n] + a * d[n] + if n > 0 { b * d[n - 1] } else { 0.0 }
        }))
    }

    /// Where the truth of self ≥ 0 departs from `inside` and changes, in (0, length], in order, with
    /// the new truth. The derivative's roots split the interval into monotone pieces; a piece holds a
    /// change if and only if it ends on the other side, so no epsilon is needed at s = 0.
    pub fn sign_changes(&self, length: f64, inside: &mut bool) -> [Option<(f64, bool)>; 3] {
        let mut ends = self
            .turning_points()
            .map(|s| if s > 0.0 && s < length { s } else { length });
        ends.sort_by(f64::total_cmp);
        let mut start = 0.0;
        [ends[0], ends[1], length].map(|end| {
            let (mut low, mut high) = (start, end);
            start = end;
            if (self.at(end) >= 0.0) == *inside {
                return None;
            }
            loop {
                let middle = 0.5 * (low + high);
                if middle <= low || middle >= high {
                    *inside = !*inside;
                    return Some((high, *inside));
                }
                if (self.at(middle) >= 0.0) == *inside {
                    low = middle
                } else {
                    high = middle
                }
            }
        })
    }

    /// The derivative's roots, in the form that cancels nothing; NaN or infinite where there is none.
    fn turning_points(&self) -> [f64; 2] {
        let [_, c, half_b, third_a] = self.0;
        let (a, b) = (3.0 * third_a, 2.0 * half_b);
        let q = -0.5 * (b + b.signum() * (b * b - 4.0 * a * c).sqrt());
        [q / a, c / q]
    }
}

fn to_grid(volume: &Volume, point: DVec3) -> DVec3 {
    (point + DVec3::from(volume.extent()) / 2.0) / DVec3::from(volume.spacing) - 0.5
}

/// The cell that holds a point, and where in it.
fn locate(volume: &Volume, point: DVec3) -> (IVec3, DVec3) {
    let grid = to_grid(volume, point);
    let cell = grid
        .floor()
        .as_ivec3()
        .clamp(IVec3::NEG_ONE, last_voxel(volume));
    (cell, grid - cell.as_dvec3())
}

fn last_voxel(volume: &Volume) -> IVec3 {
    IVec3::from_array(volume.dims.map(|n| n as i32)) - IVec3::ONE
}

/// The voxels' values; outside the grid the nearest one's.
fn voxels_of(volume: &Volume) -> impl Fn(IVec3) -> f64 {
    let voxels = volume.voxels().expect("voxels");
    let last = last_voxel(volume);
    let [nx, ny, _] = volume.dims.map(|n| n as usize);
    move |at| {
        let [x, y, z] = at.clamp(IVec3::ZERO, last).to_array().map(|i| i as usize);
        let n = x + nx * (y + ny * z);
        let stored = match &*voxels {
            Voxels::U8(voxels) => voxels[n] as f64,
            Voxels::U16(voxels) => voxels[n] as f64,
            Voxels::F32(voxels) => voxels[n] as f64,
        };
        volume.offset + volume.scale * stored
    }
}

/// What `f` says of a cell's eight voxels, x fastest.
fn corners<T>(cell: IVec3, f: impl Fn(IVec3) -> T) -> [T; 8] {
    array::from_fn(|n| {
        let n = n as i32;
        f(cell + IVec3::new(n & 1, n >> 1 & 1, n >> 2))
    })
}

fn trilinear(c: [f64; 8], at: DVec3) -> f64 {
    let mix = |low: f64, high: f64, t: f64| low + t * (high - low);
    let row = |n: usize| mix(c[n], c[n + 1], at.x);
    let face = |n: usize| mix(row(n), row(n + 2), at.y);
    mix(face(0), face(4), at.z)
}
