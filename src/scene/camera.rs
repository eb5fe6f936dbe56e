//! The camera. Right-handed: looking down −z with +y up, +x is to the right.

use glam::{DQuat, DVec3};
use serde::{Deserialize, Serialize};

use super::volume::{Anatomical, Axes};

#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Camera {
    /// In world units, as the target.
    pub eye: [f64; 3],
    pub target: [f64; 3],
    /// The direction that is up in the picture, not parallel to the view direction.
    pub up: [f64; 3],
    pub projection: Projection,
}

impl Camera {
    /// Unit vectors into the picture, to its right, and to its top.
    pub fn basis(&self) -> [DVec3; 3] {
        let forward = (DVec3::from(self.target) - DVec3::from(self.eye)).normalize();
        let right = forward.cross(DVec3::from(self.up)).normalize();
        [forward, right, right.cross(forward)]
    }

    /// This camera turned about the axis through the target along `up`, by a share of a full turn.
    pub fn orbited(&self, share: f64) -> Camera {
        let (target, up) = (DVec3::from(self.target), DVec3::from(self.up).normalize());
        let turn = DQuat::from_axis_angle(up, share * std::f64::consts::TAU);
        Camera {
            eye: (target + turn * (DVec3::from(self.eye) - target)).to_array(),
            ..*self
        }
    }
}

#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Projection {
    /// Vertical field of view in degrees, in (0, 180).
    Perspective { fov_y: f64 },
    /// Height of the picture in world units; rays start on the eye's plane.
    Orthographic { height: f64 },
}

/// A side of the box to look from. Anatomical sides are the patient's own.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Side {
    Anterior,
    Posterior,
    Left,
    Right,
    Superior,
    Inferior,
    #[serde(rename = "+x")]
    PlusX,
    #[serde(rename = "-x")]
    MinusX,
    #[serde(rename = "+y")]
    PlusY,
    #[serde(rename = "-y")]
    MinusY,
    #[serde(rename = "+z")]
    PlusZ,
    #[serde(rename = "-z")]
    MinusZ,
}

impl Side {
    /// The default view: from the front of a patient, or else the usual view of axes on paper.
    pub fn default_for(axes: Option<Axes>) -> Side {
        match axes {
            Some(_) => Side::Anterior,
            None => Side::PlusZ,
        }
    }

    /// The direction from the box's centre towards the viewer; `None` for an anatomical side where the anatomy is
    /// unknown.
    pub fn towards_eye(self, axes: Option<Axes>) -> Option<[f64; 3]> {
        let anatomical = |side| axes.map(|axes| direction_of(side, axes));
        match self {
            Side::Anterior => anatomical(Anatomical::Anterior),
            Side::Posterior => anatomical(Anatomical::Posterior),
            Side::Left => anatomical(Anatomical::Left),
            Side::Right => anatomical(Anatomical::Right),
            Side::Superior => anatomical(Anatomical::Superior),
            Side::Inferior => anatomical(Anatomical::Inferior),
            Side::PlusX => Some([1.0, 0.0, 0.0]),
            Side::MinusX => Some([-1.0, 0.0, 0.0]),
            Side::PlusY => Some([0.0, 1.0, 0.0]),
            Side::MinusY => Some([0.0, -1.0, 0.0]),
            Side::PlusZ => Some([0.0, 0.0, 1.0]),
            Side::MinusZ => Some([0.0, 0.0, -1.0]),
        }
    }
}

/// The direction that is up by default: superior, or +y where the anatomy is unknown. For a view along that
/// direction, anterior is up, as in radiology, or else the horizontal axis that the tilted head of a viewer would see
/// on top.
pub fn default_up(towards_eye: [f64; 3], axes: Option<Axes>) -> [f64; 3] {
    let (first, second) = match axes {
        Some(axes) => (
            direction_of(Anatomical::Superior, axes),
            direction_of(Anatomical::Anterior, axes),
        ),
        None => ([0.0, 1.0, 0.0], [0.0, 0.0, -towards_eye[1].signum()]),
    };
    if parallel(first, towards_eye) {
        second
    } else {
        first
    }
}

/// Whether two directions are too close to parallel for single precision to tell which way is up.
pub fn parallel(a: [f64; 3], b: [f64; 3]) -> bool {
    let [a, b] = [a, b].map(|v| DVec3::from(v).normalize_or_zero());
    a.cross(b).length() < 1e-6
}

impl Camera {
    /// A camera that looks at `target` from the given side, just far enough away that the whole box (centred on the
    /// origin) is in the picture, with a little margin around it.
    pub fn framing(
        extent: [f64; 3],
        target: [f64; 3],
        towards_eye: [f64; 3],
        up: [f64; 3],
        projection: Projection,
        aspect: f64,
    ) -> Camera {
        const MARGIN: f64 = 1.05;
        // A division, since a multiplication by the inverse would put the eye slightly beside an axis.
        let back = DVec3::from(towards_eye) / DVec3::from(towards_eye).length();
        let right = DVec3::from(up).cross(back).normalize();
        let upright = back.cross(right);
        let half = DVec3::from(extent) / 2.0;
        let distance = |corner: u32| {
            let side = |axis: u32| if corner >> axis & 1 == 1 { 1.0 } else { -1.0 };
            let offset = half * DVec3::new(side(0), side(1), side(2)) - DVec3::from(target);
            let needed = match projection {
                Projection::Perspective { fov_y } => {
                    let tangent = (fov_y.to_radians() / 2.0).tan();
                    let across = offset.dot(right).abs() / aspect;
                    MARGIN * across.max(offset.dot(upright).abs()) / tangent
                }
                // The eye's plane only has to lie in front of the box.
                Projection::Orthographic { .. } => (MARGIN - 1.0) * half.length(),
            };
            needed + offset.dot(back)
        };
        let distance = (0..8).map(distance).fold(0.0, f64::max);
        Camera {
            eye: (DVec3::from(target) + back * distance.max(half.length() * 1e-3)).to_array(),
            target,
            up,
            projection,
        }
    }

    /// A camera that looks from the same side and is at least as far away, so that the whole box stays in the picture while it
    /// turns about its target.
    pub fn framing_a_turn(self, extent: [f64; 3], aspect: f64) -> Camera {
        const DIRECTIONS: u32 = 64;
        let target = DVec3::from(self.target);
        let from_target = |camera: Camera| DVec3::from(camera.eye) - target;
        let needed = |n| {
            let turned = self.orbited(f64::from(n) / f64::from(DIRECTIONS));
            let Camera { up, projection, .. } = self;
            let towards_eye = from_target(turned).to_array();
            let framing = Camera::framing(extent, self.target, towards_eye, up, projection, aspect);
            from_target(framing).length()
        };
        let needed = (1..DIRECTIONS).map(needed).fold(0.0, f64::max);
        let (back, distance) = from_target(self).normalize_and_length();
        if needed <= distance {
            return self;
        }
        Camera {
            eye: (target + back * needed).to_array(),
            ..self
        }
    }
}

/// The unit vector along the axis that grows, or shrinks, towards `side`.
fn direction_of(side: Anatomical, Axes(axes): Axes) -> [f64; 3] {
    std::array::from_fn(|i| {
        if axes[i] == side {
            1.0
        } else if axes[i] == side.opposite() {
            -1.0
        } else {
            0.0
        }
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Whether the box is in the picture, with some air around it.
    fn shows(camera: &Camera, extent: [f64; 3], aspect: f64) -> bool {
        let back = (DVec3::from(camera.eye) - DVec3::from(camera.target)).to_array();
        let Camera { target, up, .. } = *camera;
        let closest = Camera::framing(extent, target, back, up, camera.projection, aspect);
        let distance = |camera: &Camera| (DVec3::from(camera.eye) - DVec3::from(target)).length();
        distance(camera) >= distance(&closest) * (1.0 - 1e-9)
    }

    #[test]
    fn a_box_stays_in_the_picture_while_the_camera_turns_about_it() {
        let projection = Projection::Perspective { fov_y: 40.0 };
        let (extent, aspect) = ([1.0, 1.0, 2.0], 4.0 / 3.0);
        let from =
            |side| Camera::framing(extent, [0.0; 3], side, [0.0, 1.0, 0.0], projection, aspect);
        let narrow = from([0.0, 0.0, 1.0]);
        let turned = |camera: &Camera, n: u32| camera.orbited(f64::from(n) / 8.0);
        assert!(!shows(&turned(&narrow, 2), extent, aspect));
        let farther = narrow.framing_a_turn(extent, aspect);
        for n in 0..8 {
            assert!(shows(&turned(&farther, n), extent, aspect), "{n}");
        }
        let is_far_enough = farther.framing_a_turn(extent, aspect);
        assert_eq!(is_far_enough, farther);
    }
}
