//! Directions of light as a surface's lobes have them, in bins and in nodes to integrate over.
//!
//! Directions l are laid out by their half vector h with the view v, in polar coordinates about the
//! normal, where every lobe is smooth and peaks at the pole. The half vectors in front of v stand for
//! all l, each once, with dl = 4·v·h·dh.

use std::f64::consts::TAU;

use glam::DVec3;

use super::*;
use crate::support::oracle::brdf::{clearcoat_alpha, specular_alpha};

/// Half vectors are binned into so many polar angles and azimuths.
const ROWS: usize = 32;
const COLUMNS: usize = 16;
/// Nodes of the midpoint rule along either side of a bin.
const NODES: usize = 8;

/// A normal, a direction towards the viewer, and axes that complete the normal, the first of them
/// on the viewer's side.
#[derive(Clone, Copy)]
pub struct View {
    degrees: f64,
    pub n: DVec3,
    pub v: DVec3,
    x: DVec3,
    y: DVec3,
}

impl View {
    pub fn new(degrees: f64, n: DVec3) -> View {
        let (x, y) = n.any_orthonormal_pair();
        let (sine, cosine) = degrees.to_radians().sin_cos();
        View {
            degrees,
            n,
            v: sine * x + cosine * n,
            x,
            y,
        }
    }

    pub fn describe(&self, iso: &Isosurface) -> String {
        format!("{:?}, {}°", iso.shading, self.degrees)
    }

    pub fn mirror(&self) -> DVec3 {
        2.0 * self.n.dot(self.v) * self.n - self.v
    }

    pub fn input(&self, light: DVec3, u: [f32; 3]) -> BrdfInput {
        BrdfInput {
            normal: self.n.as_vec3().to_array(),
            view: self.v.as_vec3().to_array(),
            light: light.as_vec3().to_array(),
            u,
        }
    }
}

/// From the front, aslant, and grazing; normals on both sides of the basis's seam.
pub fn views() -> [View; 3] {
    [
        View::new(0.0, DVec3::Z),
        View::new(45.0, DVec3::new(0.48, 0.6, -0.64)),
        View::new(85.0, DVec3::new(-0.6, 0.0, 0.8)),
    ]
}

/// Half of a lobe's width, as an angle of half vectors.
fn width(shading: &Shading) -> f64 {
    match *shading {
        Shading::Lambert => 1.0,
        Shading::Phong { shininess, .. } => 0.5 / (shininess + 1.0).sqrt(),
        Shading::Disney(d) => {
            let has_coat = d.clearcoat > 0.0;
            let coat = if has_coat {
                clearcoat_alpha(d.clearcoat_gloss)
            } else {
                1.0
            };
            0.5 * specular_alpha(d.roughness).min(coat)
        }
    }
}

/// Half vectors of one view. Rows start narrower than the narrowest lobe and grow with the distance
/// from it.
pub struct Lattice<'a> {
    pub view: View,
    iso: &'a Isosurface,
    width: f64,
    /// The least v·h. Below it l + v is so short that rounding turns h by ε/(v·h), no small part of
    /// v·h, which Disney's density is divided by. All these l are below the surface.
    front: f64,
}

impl Lattice<'_> {
    pub fn new(view: View, iso: &Isosurface) -> Lattice<'_> {
        let is_disney = matches!(iso.shading, Shading::Disney(_));
        Lattice {
            view,
            iso,
            width: width(&iso.shading),
            front: if is_disney { 0.004 } else { 0.0 },
        }
    }

    /// The polar angle at which v·h falls to `front`.
    fn edge(&self, azimuth: f64) -> f64 {
        let along_n = self.view.v.dot(self.view.n);
        let along_h = self.view.v.dot(self.view.x) * azimuth.cos();
        along_h.atan2(along_n) + (self.front / along_n.hypot(along_h)).acos()
    }

    /// The logarithm of (polar angle + width) grows by so much from the pole to the edge.
    fn growth(&self, azimuth: f64) -> f64 {
        (self.edge(azimuth) / self.width).ln_1p()
    }

    /// A direction and the solid angle that it stands for.
    fn node(&self, i: usize) -> (DVec3, f64) {
        let (rows, columns) = (ROWS * NODES, COLUMNS * NODES);
        let azimuth = TAU * ((i % columns) as f64 + 0.5) / columns as f64;
        let growth = self.growth(azimuth);
        let t = ((i / columns) as f64 + 0.5) / rows as f64;
        let polar = self.width * (t * growth).exp_m1();
        let View { n, v, x, y, .. } = self.view;
        let h = polar.sin() * (azimuth.cos() * x + azimuth.sin() * y) + polar.cos() * n;
        let step = (polar + self.width) * growth / rows as f64;
        let solid_angle = 4.0 * v.dot(h) * polar.sin() * step * TAU / columns as f64;
        (2.0 * v.dot(h) * h - v, solid_angle)
    }

    fn bin_of_node(i: usize) -> usize {
        let columns = COLUMNS * NODES;
        i / columns / NODES * COLUMNS + i % columns / NODES
    }

    /// The last bin is for what `lost` is about.
    pub fn bin(&self, l: DVec3) -> usize {
        let View { n, v, x, y, .. } = self.view;
        let h = (l + v).normalize();
        if self.front > 0.0 && (h.dot(n) < 0.0 || h.dot(v) < self.front) {
            return ROWS * COLUMNS;
        }
        let azimuth = h.dot(y).atan2(h.dot(x)).rem_euclid(TAU);
        let polar = h.cross(n).length().atan2(h.dot(n));
        let t = (polar / self.width).ln_1p() / self.growth(azimuth);
        let row = ((t * ROWS as f64) as usize).min(ROWS - 1);
        let column = ((azimuth / TAU * COLUMNS as f64) as usize).min(COLUMNS - 1);
        row * COLUMNS + column
    }

    pub fn nodes(&self) -> Vec<(DVec3, f64)> {
        let count = ROWS * COLUMNS * NODES * NODES;
        (0..count).map(|i| self.node(i)).collect()
    }

    /// The probabilities of all bins.
    pub fn integrate(&self, outputs: &[BrdfOutput]) -> Vec<f64> {
        let mut bins = vec![0.0; ROWS * COLUMNS];
        for (i, (output, node)) in outputs.iter().zip(self.nodes()).enumerate() {
            bins[Self::bin_of_node(i)] += f64::from(output.density) * node.1;
        }
        bins.push(self.lost());
        bins
    }

    /// The probability that Disney's lobes give a half vector that v sees from behind, or nearly.
    /// The sampler mirrors v about it all the same; l is then below the surface, where nobody asks
    /// for the density, and it knows nothing of these.
    fn lost(&self) -> f64 {
        const STEPS: usize = 1 << 12;
        let Shading::Disney(d) = self.iso.shading else {
            return 0.0;
        };
        let luminance = DVec3::from(self.iso.color).dot(DVec3::new(0.3, 0.6, 0.1));
        let diffuse = (1.0 - d.metallic) * luminance.max(0.1);
        let gtr2 = (1.0 - d.metallic) * (0.2 + 0.3 * d.specular) + d.metallic;
        let gtr1 = 0.25 * d.clearcoat;
        let (alpha, coat) = (
            specular_alpha(d.roughness),
            clearcoat_alpha(d.clearcoat_gloss),
        );
        // ∫ D·cos beyond the edge, in closed form.
        let beyond = |azimuth: f64| {
            let cosine2 = self.edge(azimuth).cos().max(0.0).powi(2);
            let spread = |alpha: f64| 1.0 - cosine2 + alpha * alpha * cosine2;
            let tail2 = alpha * alpha * cosine2 / spread(alpha);
            let tail1 = spread(coat).ln() / (coat * coat).ln();
            (gtr2 * tail2 + gtr1 * tail1) / (diffuse + gtr2 + gtr1)
        };
        let azimuth = |i: usize| TAU * (i as f64 + 0.5) / STEPS as f64;
        (0..STEPS).map(|i| beyond(azimuth(i))).sum::<f64>() / STEPS as f64
    }
}
