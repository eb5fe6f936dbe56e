//! Scenes of a few voxels and pixels that between them use the whole transport model, and both ways
//! to render them: by the oracle and by the GPU.

use isolume::gpu::Shaders;
use isolume::scene::volume::{Volume, Voxels};
use isolume::scene::*;

use super::common;
use super::fields;
use super::oracle;
use crate::support::equivalence::{Comparison, Limits, Picture, compare};

/// Runs of the GPU from which it knows its noise.
const UNITS: u32 = 16;
const PIXELS: [u32; 2] = [16, 16];

pub struct Trial {
    pub name: &'static str,
    pub scene: Scene,
    pub volume: Volume,
    /// Paths a pixel.
    pub oracle_samples: u32,
    pub gpu_samples: u32,
    pub limits: Limits,
}

/// 4×4-pixel tiles within 3 %.
pub fn within(image: f64) -> Limits {
    Limits {
        tile: 4,
        image,
        each_tile: 0.03,
        undecided: 0,
    }
}

impl Trial {
    pub fn oracle(&self) -> Picture {
        let picture = oracle::render(&self.scene, &self.volume, self.oracle_samples, 7);
        Picture {
            width: picture.width as usize,
            mean: picture.mean,
            stderr: picture.stderr,
            runs: self.oracle_samples,
        }
    }

    pub fn gpu(&self, shaders: &Shaders) -> Picture {
        let samples = self.gpu_samples / UNITS;
        let film =
            common::render_with_shaders(shaders, &self.scene, &self.volume, UNITS, samples, 11);
        Picture::from_film(&film, PIXELS[0], UNITS)
    }

    pub fn compare(&self, oracle: &Picture, shaders: &Shaders) -> Comparison {
        compare(oracle, &self.gpu(shaders), self.limits)
    }
}

/// In what the voxels are stored.
pub enum Storage {
    U8,
    U16,
    F32,
}

/// Values from −20 to 80.
const OFFSET: f64 = -20.0;
const SCALE: f64 = 100.0;

/// 16³ voxels: hills and hollows with a rough skin.
pub fn hills(storage: Storage, spacing: [f64; 3]) -> Volume {
    let mut random = fastrand::Rng::with_seed(5);
    let dims = [16; 3];
    let shares = fields::voxels(dims).map(|voxel| {
        let [x, y, z] = voxel.map(|i| f64::from(i) / 16.0);
        let wave = (7.0 * x + 1.0).sin() * (6.0 * y + 5.0 * z).cos() + (9.0 * z - 3.0 * x).sin();
        (0.45 + 0.2 * wave + 0.1 * random.f64()).clamp(0.0, 1.0)
    });
    let (voxels, most) = match storage {
        Storage::U8 => {
            let stored = shares.map(|s| (255.0 * s).round() as u8).collect();
            (Voxels::U8(stored), 255.0)
        }
        Storage::U16 => {
            let stored = shares.map(|s| (65535.0 * s).round() as u16).collect();
            (Voxels::U16(stored), 65535.0)
        }
        Storage::F32 => {
            let stored = shares.map(|s| s as f32).collect();
            (Voxels::F32(stored), 1.0)
        }
    };
    let mut volume = Volume::from_values(dims, spacing, voxels).expect("a volume");
    volume.scale = SCALE / most;
    volume.offset = OFFSET;
    volume.range = [OFFSET, OFFSET + SCALE];
    volume
}

/// The same everywhere.
pub fn block(spacing: [f64; 3]) -> Volume {
    common::constant_field(1.0, [16; 3], spacing)
}

/// Seen at an angle that no axis shares; the box, some 20 units across, fills most of the picture.
pub fn scene() -> Scene {
    let camera = Camera {
        eye: [17.0, 13.0, 24.0],
        target: [0.5, -0.3, 0.2],
        up: [0.1, 1.0, 0.0],
        projection: Projection::Perspective { fov_y: 32.0 },
    };
    let mut scene = common::empty_scene(PIXELS, camera);
    scene.lights.environment.radiance = [0.4, 0.5, 0.7];
    scene
}

/// Points (value, opacity, colour).
pub fn medium(density: f64, g: f64, points: &[(f64, f64, [f64; 3])]) -> Medium {
    let point = |&(value, opacity, color): &(f64, f64, [f64; 3])| TransferPoint {
        value,
        opacity,
        color,
    };
    Medium {
        g,
        ..Medium::isotropic(density, points.iter().map(point).collect())
    }
}

pub fn sun(direction: [f64; 3], irradiance: [f64; 3]) -> DirectionalLight {
    let length = direction.iter().map(|c| c * c).sum::<f64>().sqrt();
    DirectionalLight {
        direction: direction.map(|c| c / length),
        irradiance,
    }
}

pub fn clip(normal: [f64; 3], offset: f64) -> ClipPlane {
    let length = normal.iter().map(|c| c * c).sum::<f64>().sqrt();
    ClipPlane {
        normal: normal.map(|c| c / length),
        offset: offset / length,
    }
}

/// A blue gradient with a bright texel where no symmetry would find it.
pub fn sky_with_a_sun(brightness: f32) -> EnvironmentImage {
    let (width, height) = (16, 9);
    let mut texels: Vec<[f32; 3]> = (0..width * height)
        .map(|n| {
            let (x, y) = (n % width, n / width);
            let share = 1.0 - y as f32 / height as f32;
            [0.2 * share, 0.3 * share + 0.02 * x as f32, 0.6 * share]
        })
        .collect();
    texels[2 * width as usize + 11] = [brightness, 0.9 * brightness, 0.7 * brightness];
    EnvironmentImage {
        width,
        height,
        texels: texels.into(),
    }
}

pub fn surface(value: f64, opacity: f64, color: [f64; 3], shading: Shading) -> Isosurface {
    Isosurface {
        value,
        opacity,
        color,
        shading,
    }
}

pub const PHONG: Shading = Shading::Phong {
    specular: 0.4,
    shininess: 20.0,
};

/// Every parameter counts.
pub const DISNEY: Shading = Shading::Disney(Disney {
    metallic: 0.3,
    roughness: 0.45,
    specular: 0.7,
    specular_tint: 0.4,
    sheen: 0.6,
    sheen_tint: 0.3,
    subsurface: 0.5,
    clearcoat: 0.8,
    clearcoat_gloss: 0.4,
});
