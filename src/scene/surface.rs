//! Isosurfaces V = value and their materials.

use serde::{Deserialize, Serialize};

/// The most surfaces of a scene: a path keeps its side of each in one word.
pub const MOST_SURFACES: usize = 32;

/// The problem with so many surfaces, if there is one.
pub fn excess(count: usize) -> Option<String> {
    (count > MOST_SURFACES)
        .then(|| format!("found {count} surfaces, expected at most {MOST_SURFACES}; remove some"))
}

#[derive(Debug, Clone, PartialEq)]
pub struct Surfaces {
    pub light: LightModel,
    pub normals: Normals,
    /// Their values differ from each other.
    pub iso: Vec<Isosurface>,
}

/// Which rays see surfaces.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum LightModel {
    /// Only the camera's straight segment.
    Local,
    /// Every ray; shadow rays are multiplied by 1 − opacity at each crossing.
    Full,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Normals {
    /// Central differences at voxels, interpolated trilinearly.
    Smooth,
    /// The interpolant's own gradient.
    Analytic,
}

#[derive(Debug, Clone, PartialEq)]
pub struct Isosurface {
    /// The isovalue, in the data's units.
    pub value: f64,
    /// Probability of reflection, in [0, 1]; a ray that is not reflected passes as if the surface were absent.
    pub opacity: f64,
    /// Diffuse reflectance of each channel, in [0, 1].
    pub color: [f64; 3],
    pub shading: Shading,
}

#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Shading {
    /// color/π.
    Lambert,
    /// (1−s)·color/π + s·(k+2)/2π·max(0, cos α)^k about the mirror direction.
    Phong {
        /// Share of the lobe, in [0, 1].
        specular: f64,
        /// Exponent of the lobe, from 0 to 1e12.
        shininess: f64,
    },
    Disney(Disney),
}

/// Burley 2012, isotropic; D and G both with α = max(roughness², 1e-3).
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Disney {
    pub metallic: f64,
    pub roughness: f64,
    pub specular: f64,
    pub specular_tint: f64,
    pub sheen: f64,
    pub sheen_tint: f64,
    pub subsurface: f64,
    pub clearcoat: f64,
    pub clearcoat_gloss: f64,
}

impl Default for Disney {
    fn default() -> Disney {
        Disney {
            metallic: 0.0,
            roughness: 0.5,
            specular: 0.5,
            specular_tint: 0.0,
            sheen: 0.0,
            sheen_tint: 0.5,
            subsurface: 0.0,
            clearcoat: 0.0,
            clearcoat_gloss: 1.0,
        }
    }
}
