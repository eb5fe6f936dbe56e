//! Transmittance by the midpoint rule in double precision, written straight from the contract.

use glam::DVec3;
use isolume::scene::volume::{Volume, Voxels};
use isolume::scene::{Camera, Medium, Projection, Scene};

use crate::support::common::empty_scene;
use crate::support::exact::expect;

/// A square picture's side, in rays, and points along each.
const RAYS: u32 = 64;
const POINTS: u32 = 4000;

/// A medium that only absorbs, in a white furnace: a pixel shows its transmittance.
pub fn absorbing_scene(medium: Medium, camera: Camera) -> Scene {
    let mut scene = empty_scene([32, 32], camera);
    scene.lights.environment.radiance = [1.0; 3];
    scene.medium = Some(medium);
    scene
}

/// Looks at the origin.
pub fn orthographic(eye: [f64; 3], height: f64) -> Camera {
    Camera {
        eye,
        target: [0.0; 3],
        up: [0.1, 0.9, 0.3],
        projection: Projection::Orthographic { height },
    }
}

/// Compares a square picture of an orthographic camera.
pub fn expect_transmittance(what: &str, scene: &Scene, volume: &Volume) {
    expect(what, scene, volume, [transmittance(scene, volume, RAYS); 3]);
}

/// Mean of `transmittances`.
pub fn transmittance(scene: &Scene, volume: &Volume, rays: u32) -> f64 {
    let each = transmittances(scene, volume, rays);
    each.iter().sum::<f64>() / each.len() as f64
}

/// Along `rays` × `rays` rays through the middles of equal parts of the picture, row by row from its top.
pub fn transmittances(scene: &Scene, volume: &Volume, rays: u32) -> Vec<f64> {
    let camera = &scene.camera;
    let Projection::Orthographic { height } = camera.projection else {
        panic!("only for orthographic cameras");
    };
    let eye = DVec3::from(camera.eye);
    let forward = (DVec3::from(camera.target) - eye).normalize();
    let right = forward.cross(DVec3::from(camera.up)).normalize();
    let up = right.cross(forward);
    let field = Field::new(volume);
    let across = |i: u32| height * ((f64::from(i) + 0.5) / f64::from(rays) - 0.5);
    let ray = |i: u32| {
        let origin = eye + across(i % rays) * right - across(i / rays) * up;
        (-optical_depth(scene, &field, origin, forward)).exp()
    };
    (0..rays * rays).map(ray).collect()
}

fn optical_depth(scene: &Scene, field: &Field, origin: DVec3, direction: DVec3) -> f64 {
    let Some(medium) = &scene.medium else {
        return 0.0;
    };
    let [near, far] = field.inside_box(origin, direction);
    let step = (far - near).max(0.0) / f64::from(POINTS);
    let extinction = |k: u32| {
        let p = origin + (near + (f64::from(k) + 0.5) * step) * direction;
        let clipped = |c: &isolume::scene::ClipPlane| DVec3::from(c.normal).dot(p) > c.offset;
        if scene.clips.iter().any(clipped) {
            0.0
        } else {
            medium.density * medium.classify(field.value(p)).0
        }
    };
    (0..POINTS).map(extinction).sum::<f64>() * step
}

/// The trilinear interpolant.
struct Field {
    dims: [usize; 3],
    extent: DVec3,
    spacing: DVec3,
    voxels: Vec<f64>,
}

impl Field {
    fn new(volume: &Volume) -> Field {
        let value = |stored: f64| volume.offset + volume.scale * stored;
        let voxels = match &*volume.voxels().expect("voxels") {
            Voxels::U8(voxels) => voxels.iter().map(|&v| value(v.into())).collect(),
            Voxels::U16(voxels) => voxels.iter().map(|&v| value(v.into())).collect(),
            Voxels::F32(voxels) => voxels.iter().map(|&v| value(v.into())).collect(),
        };
        Field {
            dims: volume.dims.map(|size| size as usize),
            extent: volume.extent().into(),
            spacing: volume.spacing.into(),
            voxels,
        }
    }

    /// Distances at which a ray enters the box and leaves it.
    fn inside_box(&self, origin: DVec3, direction: DVec3) -> [f64; 2] {
        let mut span = [0.0, f64::INFINITY];
        for a in 0..3 {
            let side = |sign: f64| (sign * 0.5 * self.extent[a] - origin[a]) / direction[a];
            if direction[a] != 0.0 {
                span[0] = f64::max(span[0], side(-1.0).min(side(1.0)));
                span[1] = f64::min(span[1], side(-1.0).max(side(1.0)));
            } else if origin[a].abs() > 0.5 * self.extent[a] {
                return [0.0; 2];
            }
        }
        span
    }

    /// Clamped in the outer half voxel.
    fn value(&self, p: DVec3) -> f64 {
        let [width, height, _] = self.dims;
        let along = |a: usize| {
            let last = self.dims[a] - 1;
            let x = ((p[a] + 0.5 * self.extent[a]) / self.spacing[a] - 0.5).clamp(0.0, last as f64);
            let low = x as usize;
            (low, (low + 1).min(last), x.fract())
        };
        let [(x0, x1, tx), (y0, y1, ty), (z0, z1, tz)] = [along(0), along(1), along(2)];
        let mix = |a: f64, b: f64, t: f64| (1.0 - t) * a + t * b;
        let row = |y: usize, z: usize| {
            let row = &self.voxels[width * (y + height * z)..];
            mix(row[x0], row[x1], tx)
        };
        let slice = |z: usize| mix(row(y0, z), row(y1, z), ty);
        mix(slice(z0), slice(z1), tz)
    }
}
