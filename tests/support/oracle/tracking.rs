//! The medium: free flights, transmittance, and the phase function.

use super::field::{self, Cubic, Ray, Segment};
use super::random::Random;
use glam::DVec3;
use isolume::scene::Medium;
use isolume::scene::volume::Volume;
use std::f64::consts::PI;

/// Delta tracking against one majorant of everything: where the ray first collides between t0 and
/// t1, and the albedo there.
pub fn collision(
    volume: &Volume,
    medium: &Medium,
    ray: &Ray,
    t0: f64,
    t1: f64,
    random: &mut Random,
) -> Option<(f64, DVec3)> {
    let majorant = majorant(medium)?;
    let mut t = t0;
    loop {
        t += random.exponential() / majorant;
        if t >= t1 {
            return None;
        }
        let (extinction, albedo) = properties(volume, medium, ray.at(t));
        if random.uniform() * majorant < extinction {
            return Some((t, albedo));
        }
    }
}

/// Ratio tracking: an unbiased estimate of the transmittance between t0 and t1.
pub fn estimate_transmittance(
    volume: &Volume,
    medium: &Medium,
    ray: &Ray,
    t0: f64,
    t1: f64,
    random: &mut Random,
) -> f64 {
    let Some(majorant) = majorant(medium) else {
        return 1.0;
    };
    let (mut t, mut transmittance) = (t0, 1.0);
    while transmittance > 0.0 {
        t += random.exponential() / majorant;
        if t >= t1 {
            break;
        }
        transmittance *= 1.0 - properties(volume, medium, ray.at(t)).0 / majorant;
    }
    transmittance
}

/// The exact transmittance from a to b, without clip planes.
pub fn transmittance(volume: &Volume, medium: &Medium, a: DVec3, b: DVec3) -> f64 {
    let direction = (b - a).normalize();
    let ray = Ray {
        origin: a,
        direction,
    };
    let Some((t0, t1)) = field::interval(volume, &[], &ray) else {
        return 1.0;
    };
    let depth: f64 = field::segments(volume, ray, t0, t1.min(a.distance(b)))
        .map(|segment| optical_depth(volume, medium, &ray, &segment))
        .sum();
    (-depth).exp()
}

/// Between the crossings of the transfer function's values extinction is a cubic, which two-point
/// Gauss–Legendre integrates exactly.
fn optical_depth(volume: &Volume, medium: &Medium, ray: &Ray, segment: &Segment) -> f64 {
    let length = segment.end - segment.start;
    let mut breaks = vec![0.0, length];
    for point in &medium.transfer {
        let cubic = field::cubic_along(volume, ray, segment, point.value);
        let changes = cubic.sign_changes(length, &mut (cubic.at(0.0) >= 0.0));
        breaks.extend(changes.into_iter().flatten().map(|(s, _)| s));
    }
    breaks.sort_by(f64::total_cmp);
    let value: Cubic = field::cubic_along(volume, ray, segment, 0.0);
    let extinction = |s: f64| medium.density * medium.classify(value.at(s)).0;
    let piece = |s: &[f64]| {
        let (middle, half) = (0.5 * (s[0] + s[1]), 0.5 * (s[1] - s[0]));
        let node = half / 3_f64.sqrt();
        half * (extinction(middle - node) + extinction(middle + node))
    };
    breaks.windows(2).map(piece).sum()
}

/// None: there is nothing to collide with.
fn majorant(medium: &Medium) -> Option<f64> {
    let opacity = medium
        .transfer
        .iter()
        .map(|p| p.opacity)
        .fold(0.0, f64::max);
    let majorant = medium.density * opacity;
    (majorant > 0.0).then_some(majorant)
}

/// Extinction and albedo at a point inside the box.
fn properties(volume: &Volume, medium: &Medium, point: DVec3) -> (f64, DVec3) {
    let (opacity, color) = medium.classify(field::value_at(volume, point));
    (medium.density * opacity, color.into())
}

/// Henyey–Greenstein; `cosine` is 1 straight ahead.
pub fn phase(g: f64, cosine: f64) -> f64 {
    let base = 1.0 + g * g - 2.0 * g * cosine;
    (1.0 - g * g) / (4.0 * PI * base * base.sqrt())
}

/// A direction distributed as the phase function.
pub fn scatter(g: f64, direction: DVec3, random: &mut Random) -> DVec3 {
    let u = random.uniform();
    let ratio = (1.0 - g) / (1.0 - g + 2.0 * g * u);
    // The textbook's inversion, rearranged so that g → 0 needs no case of its own.
    let cosine = 1.0 - 2.0 * (1.0 - u) * (1.0 + g * u) * ratio * ratio;
    random.around(direction, cosine.clamp(-1.0, 1.0))
}
