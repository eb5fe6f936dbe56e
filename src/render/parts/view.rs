//! The camera and the picture's pixels.

use glam::DVec3;

use crate::render::features::Features;
use crate::scene::{Camera, Projection};

/// Nearer to the box than so many times its radius, an eye costs rays less than a thousandth of a voxel.
const FAR: f64 = 4.0;
/// Rays from a distant eye start at this distance from the box's centre, in its radii.
const MARGIN: f64 = 1.01;

/// The camera's frame, scaled to the picture.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct View {
    /// In pixels.
    pub size: [u32; 2],
    /// Where rays start: the eye, or, if it is far away, the point straight ahead of it just before the box. In single precision,
    /// rays from there are off by less.
    pub start: [f32; 3],
    /// From the eye to `start`.
    pub start_distance: f32,
    /// Unit direction into the picture.
    pub forward: [f32; 3],
    /// From the picture's centre to its right edge, at distance 1 (perspective) or in world units
    /// (orthographic).
    pub right: [f32; 3],
    /// From the picture's centre to its top edge, in the same unit.
    pub up: [f32; 3],
    pub is_orthographic: bool,
    /// Whether rays go through the middle of each pixel, and not anywhere in it.
    pub through_centres: bool,
}

impl View {
    /// `radius` is that of a ball around the box.
    pub fn new(camera: &Camera, size: [u32; 2], radius: f64) -> View {
        let [forward, right, up] = camera.basis();
        let eye = DVec3::from(camera.eye);
        let depth = -eye.dot(forward);
        let before_box = depth - MARGIN * radius;
        // The box's centre is the origin. Its depth is taken off first: of a very distant eye, it is all that is left of the
        // digits.
        let (start, start_distance) = if before_box > FAR * radius {
            (
                eye + depth * forward - MARGIN * radius * forward,
                before_box,
            )
        } else {
            (eye, 0.0)
        };
        let half_height = match camera.projection {
            Projection::Perspective { fov_y } => (0.5 * fov_y.to_radians()).tan(),
            Projection::Orthographic { height } => 0.5 * height,
        };
        let half_width = half_height * f64::from(size[0]) / f64::from(size[1]);
        View {
            size,
            start: start.as_vec3().to_array(),
            start_distance: start_distance as f32,
            forward: forward.as_vec3().to_array(),
            right: (right * half_width).as_vec3().to_array(),
            up: (up * half_height).as_vec3().to_array(),
            is_orthographic: matches!(camera.projection, Projection::Orthographic { .. }),
            through_centres: false,
        }
    }

    /// Sets the features that shaders are compiled with because of the view.
    pub fn require(&self, features: &mut Features) {
        features.is_orthographic = self.is_orthographic;
    }

    /// The same view in a picture with fewer or more pixels. Its proportions stay, although rounding may have changed
    /// those of `size` a little.
    pub fn with_size(self, size: [u32; 2]) -> View {
        View { size, ..self }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn rays_of_the_most_distant_eye_start_before_the_box() {
        for distance in [1e3, 1e18, 3e38] {
            let camera = Camera {
                eye: [0.0, 0.0, distance],
                target: [0.0; 3],
                up: [0.0, 1.0, 0.0],
                projection: Projection::Orthographic { height: 8.0 },
            };
            let View { start, .. } = View::new(&camera, [8, 8], 5.0);
            assert_eq!(start[..2], [0.0; 2]);
            assert!((5.0..6.0).contains(&start[2]), "{distance}: {start:?}");
        }
    }
}
