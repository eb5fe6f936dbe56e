//! Double precision judges what single precision found, on the very same ray.
//!
//! An f32 program cannot know V better than its own rounding. In a cell whose corners lie within M of
//! the isovalue, V along a ray is a cubic whose coefficients come from some thirty operations on
//! numbers up to 8M, most of them far smaller, and the side of a cell is met at a t known to half a
//! unit in its last place, over which V changes by at most 2√3·M a voxel. The *band* is their sum,
//! M·2⁻²⁴·(32 + 4·voxels travelled): below 2e-5·M in all that follows. An answer is
//!
//! - *exact* if it is the f64 finder's: the same surface within 1e-3 of a voxel, or none as well;
//! - *within rounding* if it is not, but V at the answer is the isovalue to within the band, and it
//!   comes neither before V could first have crossed by the band nor after V must have crossed by it;
//! - *wrong* otherwise.

use glam::{DVec3, IVec3};
use isolume::scene::volume::{Volume, Voxels};

use super::{Found, TestRay};
use crate::support::oracle::field::{self, Cubic, Ray, Segment};

/// In voxels.
const DEPTH_ERROR: f64 = 1e-3;

#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Verdict {
    /// With the error of the depth, in voxels.
    Exact(f64),
    WithinRounding,
    Wrong,
}

pub struct Judge {
    /// The volume with voxels of size 1, so that its world space is grid space but for an offset.
    unit: Volume,
    /// Ascending or not, as the scene has them.
    values: Vec<f64>,
}

impl Judge {
    pub fn new(volume: &Volume, values: &[f64]) -> Judge {
        let mut unit = volume.clone();
        unit.spacing = [1.0; 3];
        Judge {
            unit,
            values: values.to_vec(),
        }
    }

    pub fn ray(&self, ray: &TestRay) -> Ray {
        let offset = DVec3::from(self.unit.extent()) / 2.0 + 0.5;
        Ray {
            origin: DVec3::from_array(ray.origin.map(f64::from)) - offset,
            direction: DVec3::from_array(ray.step.map(f64::from)),
        }
    }

    /// All crossings of one surface.
    pub fn crossings(&self, ray: &TestRay, surface: usize) -> Vec<f64> {
        self.crossings_of(ray, self.values[surface], None, 0.0)
    }

    /// The first crossing beyond `from` of a ray that leaves the surface to side `inside`. It starts
    /// some f32 rounding off the surface, and both are right: V = value, and V as it is at the start.
    pub fn next_crossings(&self, ray: &TestRay, from: f64, inside: bool) -> [Option<f64>; 2] {
        let start = field::value_at(&self.unit, self.ray(ray).origin);
        [self.values[0], start].map(|value| {
            let all = self.crossings_of(ray, value, Some(inside), from);
            all.first().copied()
        })
    }

    /// All crossings of all surfaces, in order, with every value raised by `shift` bands.
    pub fn all_crossings(&self, ray: &TestRay, shift: f64) -> Vec<(f64, usize)> {
        let mut all = Vec::new();
        for (s, &value) in self.values.iter().enumerate() {
            let value = value + shift * self.widest_band(ray, value);
            let crossings = self.crossings_of(ray, value, None, 0.0);
            all.extend(crossings.into_iter().map(|t| (t, s)));
        }
        all.sort_by(|a, b| a.0.total_cmp(&b.0));
        all
    }

    fn crossings_of(&self, ray: &TestRay, value: f64, inside: Option<bool>, from: f64) -> Vec<f64> {
        field::crossings(
            &self.unit,
            value,
            self.ray(ray),
            from,
            ray.t_end.into(),
            inside,
        )
        .map(|c| c.t)
        .collect()
    }

    /// Sides at the ray's end, with `None` where V is within the band of the value.
    pub fn sides_at_end(&self, ray: &TestRay) -> Vec<Option<bool>> {
        let end = self.ray(ray).at(ray.t_end.into());
        let side = |&value: &f64| {
            let above = field::value_at(&self.unit, end) - value;
            (above.abs() > self.widest_band(ray, value)).then_some(above >= 0.0)
        };
        self.values.iter().map(side).collect()
    }

    /// The first crossing of any surface, for a ray that begins on the given sides.
    pub fn first(&self, ray: &TestRay, sides: &[bool]) -> Option<(f64, usize)> {
        let (r, t_end) = (self.ray(ray), f64::from(ray.t_end));
        let first = |s: usize| {
            field::crossings(&self.unit, self.values[s], r, 0.0, t_end, Some(sides[s]))
                .next()
                .map(|c| (c.t, s))
        };
        (0..self.values.len())
            .filter_map(first)
            .min_by(|a, b| a.0.total_cmp(&b.0))
    }

    pub fn verdict(&self, ray: &TestRay, found: &Found) -> Verdict {
        let Some(sides) = self.sides(ray, found.inside) else {
            return Verdict::Wrong;
        };
        let exact = self.first(ray, &sides);
        let found = (found.surface >= 0).then_some((f64::from(found.t), found.surface as usize));
        let voxels = self.ray(ray).direction.length();
        match (exact, found) {
            (None, None) => return Verdict::Exact(0.0),
            (Some((t, s)), Some((u, r))) if s == r && (t - u).abs() * voxels <= DEPTH_ERROR => {
                return Verdict::Exact((t - u).abs() * voxels);
            }
            _ => {}
        }
        let possible = match found {
            Some((t, s)) => self.may_cross_at(ray, t, s) && !self.surely_crossed(ray, &sides, t),
            None => !self.surely_crossed(ray, &sides, f64::from(ray.t_end)),
        };
        if possible {
            Verdict::WithinRounding
        } else {
            Verdict::Wrong
        }
    }

    /// On which side of each surface the ray begins: where V is within the band of the value, the
    /// side that was found; `None` if what was found is wrong.
    fn sides(&self, ray: &TestRay, found: u32) -> Option<Vec<bool>> {
        let r = self.ray(ray);
        let start = field::segments(&self.unit, r, 0.0, ray.t_end.into()).next();
        let side = |(s, &value): (usize, &f64)| {
            let found = found >> s & 1 == 1;
            let Some(segment) = start else {
                return Some(found);
            };
            let above = field::cubic_along(&self.unit, &r, &segment, value).at(0.0);
            let in_doubt = above.abs() <= self.band(&r, &segment, value);
            (in_doubt || found == (above >= 0.0)).then_some(found)
        };
        self.values.iter().enumerate().map(side).collect()
    }

    /// V at t is the surface's value to within the band, or crosses it within the depth's error.
    fn may_cross_at(&self, ray: &TestRay, t: f64, surface: usize) -> bool {
        let r = self.ray(ray);
        let near = DEPTH_ERROR / r.direction.length();
        let (from, to) = ((t - near).max(0.0), (t + near).min(ray.t_end.into()));
        let value = self.values[surface];
        field::segments(&self.unit, r, from, to).any(|segment| {
            let band = self.band(&r, &segment, value);
            let cubic = field::cubic_along(&self.unit, &r, &segment, value);
            let length = segment.end - segment.start;
            cubic.at(0.0).abs() <= band
                || cubic.at(length).abs() <= band
                || changes(&cubic, length, cubic.at(0.0) >= 0.0)
        })
    }

    /// Whether V has left the side on which the ray began, by more than the band, on the way to t.
    fn surely_crossed(&self, ray: &TestRay, sides: &[bool], t: f64) -> bool {
        let r = self.ray(ray);
        let before = t - DEPTH_ERROR / r.direction.length();
        self.values.iter().zip(sides).any(|(&value, &inside)| {
            field::segments(&self.unit, r, 0.0, before).any(|segment| {
                let band = self.band(&r, &segment, value);
                let mut cubic = field::cubic_along(&self.unit, &r, &segment, value);
                cubic.0[0] += if inside { band } else { -band };
                let length = segment.end - segment.start;
                (cubic.at(0.0) >= 0.0) != inside || changes(&cubic, length, inside)
            })
        })
    }

    fn band(&self, r: &Ray, segment: &Segment, value: f64) -> f64 {
        let travelled = segment.end * r.direction.length();
        let largest = (0..8)
            .map(|n| segment.cell + IVec3::new(n & 1, n >> 1 & 1, n >> 2))
            .map(|at| (self.voxel(at) - value).abs())
            .fold(0.0, f64::max);
        largest * 2f64.powi(-24) * (32.0 + 4.0 * travelled)
    }

    /// Of all cells along the ray.
    fn widest_band(&self, ray: &TestRay, value: f64) -> f64 {
        let r = self.ray(ray);
        field::segments(&self.unit, r, 0.0, ray.t_end.into())
            .map(|segment| self.band(&r, &segment, value))
            .fold(0.0, f64::max)
    }

    fn voxel(&self, at: IVec3) -> f64 {
        let [nx, ny, nz] = self.unit.dims.map(|n| n as i32);
        let at = at.clamp(IVec3::ZERO, IVec3::new(nx, ny, nz) - 1);
        let n = (at.x + nx * (at.y + ny * at.z)) as usize;
        match &*self.unit.voxels().expect("voxels") {
            Voxels::U8(v) => f64::from(v[n]),
            Voxels::U16(v) => f64::from(v[n]),
            Voxels::F32(v) => f64::from(v[n]),
        }
    }
}

fn changes(cubic: &Cubic, length: f64, mut inside: bool) -> bool {
    cubic
        .sign_changes(length, &mut inside)
        .iter()
        .any(Option::is_some)
}
