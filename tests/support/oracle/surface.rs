//! Isosurfaces along a ray: which one reflects first, how much they block, how they are oriented.

use super::brdf;
use super::field::{self, Crossing, Ray};
use super::random::Random;
use glam::DVec3;
use isolume::scene::volume::Volume;
use isolume::scene::{Isosurface, Normals, Surfaces};

/// The surface that a ray leaves, and the truth of V ≥ value on the side to which it leaves.
#[derive(Debug, Clone, Copy)]
pub struct Departure {
    pub surface: usize,
    pub inside: bool,
}

/// A ray arriving at a surface that reflects it.
#[derive(Debug, Clone, Copy)]
pub struct Hit<'a> {
    pub t: f64,
    pub iso: &'a Isosurface,
    pub departure: Departure,
    /// Towards where the ray came from.
    outgoing: DVec3,
    /// n_g, on the ray's side.
    geometric: DVec3,
    /// The normal for shading, on the ray's side.
    normal: DVec3,
}

/// The first crossing that reflects. Each crossing decides for itself with probability `opacity`, so
/// the first is the nearest of every surface's own first.
pub fn first_hit<'a>(
    volume: &Volume,
    surfaces: &'a Surfaces,
    ray: &Ray,
    (t0, t1): (f64, f64),
    left: Option<Departure>,
    random: &mut Random,
) -> Option<Hit<'a>> {
    let mut nearest: Option<(usize, Crossing)> = None;
    for (n, iso) in surfaces.iso.iter().enumerate() {
        let end = nearest.map_or(t1, |(_, other)| other.t);
        let reflecting = field::crossings(volume, iso.value, *ray, t0, end, side(left, n))
            .find(|_| random.uniform() < iso.opacity);
        if let Some(crossing) = reflecting
            && nearest.is_none_or(|(_, other)| crossing.t < other.t)
        {
            nearest = Some((n, crossing));
        }
    }
    nearest.map(|(n, crossing)| Hit::new(volume, surfaces, n, &crossing, ray))
}

/// What the surfaces let through between t0 and t1: 1 − opacity at each crossing.
pub fn passing(
    volume: &Volume,
    surfaces: &Surfaces,
    ray: &Ray,
    (t0, t1): (f64, f64),
    left: Option<Departure>,
) -> f64 {
    let passing = |(n, iso): (usize, &Isosurface)| -> f64 {
        field::crossings(volume, iso.value, *ray, t0, t1, side(left, n))
            .map(|_| 1.0 - iso.opacity)
            .product()
    };
    surfaces.iso.iter().enumerate().map(passing).product()
}

fn side(left: Option<Departure>, surface: usize) -> Option<bool> {
    left.filter(|l| l.surface == surface).map(|l| l.inside)
}

/// On the side of a cell in which the field is constant, the gradient is that of the cell on the other side.
fn gradient_at(volume: &Volume, ray: &Ray, crossing: &Crossing) -> DVec3 {
    let point = ray.at(crossing.t);
    let gradient = field::gradient_in_cell(volume, crossing.cell, point);
    if gradient != DVec3::ZERO {
        return gradient;
    }
    let beside = 1e-6 * DVec3::from_array(volume.spacing) * ray.direction.signum();
    field::gradient_analytic(volume, point - beside)
        + field::gradient_analytic(volume, point + beside)
}

impl<'a> Hit<'a> {
    fn new(
        volume: &Volume,
        surfaces: &'a Surfaces,
        surface: usize,
        crossing: &Crossing,
        ray: &Ray,
    ) -> Hit<'a> {
        let outgoing = -ray.direction;
        let point = ray.at(crossing.t);
        // The ray goes up the gradient where it enters: the side it comes from lies down the gradient.
        let facing = if crossing.entering { -1.0 } else { 1.0 };
        let geometric = facing * gradient_at(volume, ray, crossing);
        let geometric = geometric.try_normalize().unwrap_or(outgoing);
        let normal = match surfaces.normals {
            Normals::Analytic => geometric,
            Normals::Smooth => (facing * field::gradient_smooth(volume, point))
                .try_normalize()
                .filter(|n| n.dot(outgoing) > 0.0)
                .unwrap_or(geometric),
        };
        let departure = Departure {
            surface,
            inside: !crossing.entering,
        };
        let iso = &surfaces.iso[surface];
        Hit {
            t: crossing.t,
            iso,
            departure,
            outgoing,
            geometric,
            normal,
        }
    }

    /// BRDF times cosine: the part of the light arriving from `incoming` that the ray sees.
    pub fn reflectance(&self, incoming: DVec3) -> DVec3 {
        if self.geometric.dot(incoming) <= 0.0 {
            return DVec3::ZERO;
        }
        brdf::evaluate(self.iso, self.normal, self.outgoing, incoming)
            * self.normal.dot(incoming).max(0.0)
    }

    /// A direction from which light may arrive, and `reflectance` over its density.
    pub fn sample(&self, random: &mut Random) -> (DVec3, DVec3) {
        let incoming = brdf::sample(self.iso, self.normal, self.outgoing, random);
        let reflectance = self.reflectance(incoming);
        if reflectance == DVec3::ZERO {
            return (incoming, DVec3::ZERO);
        }
        let density = brdf::density(self.iso, self.normal, self.outgoing, incoming);
        (incoming, reflectance / density)
    }
}
