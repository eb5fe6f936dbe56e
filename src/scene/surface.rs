//! Isosurfaces V = value and what they are made of.

use serde::{Deserialize, Serialize};

#[derive(Debug, Clone, PartialEq)]
pub struct Surfaces {
    pub light: LightModel,
    pub normals: Normals,
    /// Values differ from each other.
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
    /// In the data's units.
    pub value: f64,
    /// Probability of reflecting; absent otherwise. In [0, 1].
    pub opacity: f64,
    pub color: [f64; 3],
    pub shading: Shading,
}

#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Shading {
    /// color/π.
    Lambert,
    /// (1−s)·color/π + s·(k+2)/2π·max(0, cos α)^k about the mirror direction.
    Phong { specular: f64, shininess: f64 },
    /// Burley 2012, isotropic; D and G both with α = max(roughness², 1e-3).
    Disney {
        metallic: f64,
        roughness: f64,
        specular: f64,
        specular_tint: f64,
        sheen: f64,
        sheen_tint: f64,
        subsurface: f64,
        clearcoat: f64,
        clearcoat_gloss: f64,
    },
}
