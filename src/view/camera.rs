//! Moving the camera by hand: a turntable about the target, whose axis is the camera's own `up`.

use glam::{DQuat, DVec3};

use crate::scene::volume::Axes;
use crate::scene::{Camera, Projection, Side};

/// The least angle between the view direction and the axis: a camera that looks along the axis has no direction that
/// is up.
const POLE_DEGREES: f64 = 1.0;

/// Turns the camera by a drag to the right and down, as a share of the picture's height. The whole height is half a
/// turn.
pub fn orbit(camera: &Camera, drag: [f64; 2]) -> Camera {
    let [_, _, up] = camera.basis();
    let axis = DVec3::from(camera.up).normalize();
    let arm = DVec3::from(camera.eye) - DVec3::from(camera.target);
    let yaw = DQuat::from_axis_angle(axis, -drag[0] * std::f64::consts::PI);
    let inclination = arm.angle_between(axis);
    let pole = POLE_DEGREES.to_radians();
    let wanted = inclination - drag[1] * std::f64::consts::PI;
    let pitch = inclination - wanted.clamp(pole, std::f64::consts::PI - pole);
    let right = up.cross(arm.normalize());
    let turned = yaw * (DQuat::from_axis_angle(right, -pitch) * arm);
    Camera {
        eye: (DVec3::from(camera.target) + turned).to_array(),
        ..*camera
    }
}

/// Shifts the camera so that the point at the target follows the pointer.
pub fn pan(camera: &Camera, drag: [f64; 2]) -> Camera {
    let [_, right, up] = camera.basis();
    let shift = (up * drag[1] - right * drag[0]) * height_at_target(camera);
    let moved = |p: [f64; 3]| (DVec3::from(p) + shift).to_array();
    Camera {
        eye: moved(camera.eye),
        target: moved(camera.target),
        ..*camera
    }
}

/// Moves the camera by steps of a wheel; forward comes nearer.
pub fn zoom(camera: &Camera, steps: f64) -> Camera {
    let factor = 0.9f64.powf(steps);
    let target = DVec3::from(camera.target);
    let arm = DVec3::from(camera.eye) - target;
    match camera.projection {
        Projection::Perspective { .. } => Camera {
            eye: (target + arm * factor).to_array(),
            ..*camera
        },
        Projection::Orthographic { height } => Camera {
            projection: Projection::Orthographic {
                height: height * factor,
            },
            ..*camera
        },
    }
}

/// The six sides behind the keys 1 to 6.
pub fn named_views(axes: Option<Axes>) -> [Side; 6] {
    match axes {
        Some(_) => [
            Side::Anterior,
            Side::Posterior,
            Side::Left,
            Side::Right,
            Side::Superior,
            Side::Inferior,
        ],
        None => [
            Side::PlusZ,
            Side::MinusZ,
            Side::MinusX,
            Side::PlusX,
            Side::PlusY,
            Side::MinusY,
        ],
    }
}

/// Height of the picture in world units at the target's distance.
pub fn height_at_target(camera: &Camera) -> f64 {
    let distance = DVec3::from(camera.eye).distance(DVec3::from(camera.target));
    height_at(camera.projection, distance)
}

/// Height of the picture in world units at a depth before the eye's plane.
fn height_at(projection: Projection, depth: f64) -> f64 {
    match projection {
        Projection::Perspective { fov_y } => 2.0 * depth * (0.5 * fov_y.to_radians()).tan(),
        Projection::Orthographic { height } => height,
    }
}

/// Position of a point of the world in the picture: from its centre, as shares of its height, to the right and down.
/// `None` behind the eye.
pub fn project(camera: &Camera, point: DVec3) -> Option<[f64; 2]> {
    let [forward, right, up] = camera.basis();
    let from_eye = point - DVec3::from(camera.eye);
    let height = height_at(camera.projection, from_eye.dot(forward));
    if height <= 0.0 {
        return None;
    }
    Some([from_eye.dot(right) / height, -from_eye.dot(up) / height])
}

#[cfg(test)]
mod tests {
    use super::*;

    fn camera() -> Camera {
        Camera {
            eye: [0.0, 0.0, 10.0],
            target: [0.0; 3],
            up: [0.0, 1.0, 0.0],
            projection: Projection::Perspective { fov_y: 40.0 },
        }
    }

    fn near(a: [f64; 3], b: [f64; 3]) -> bool {
        DVec3::from(a).distance(DVec3::from(b)) < 1e-9
    }

    #[test]
    fn a_drag_to_the_right_brings_the_left_side_into_sight() {
        let turned = orbit(&camera(), [0.5, 0.0]);
        assert!(near(turned.eye, [-10.0, 0.0, 0.0]), "{turned:?}");
    }

    #[test]
    fn a_drag_down_brings_the_top_into_sight_and_stops_at_the_pole() {
        assert!(orbit(&camera(), [0.0, 0.2]).eye[1] > 0.0);
        let highest = orbit(&camera(), [0.0, 7.0]);
        assert!(
            highest.eye[1] < 10.0 && highest.eye[1] > 9.99,
            "{highest:?}"
        );
    }

    #[test]
    fn what_lies_at_the_target_follows_a_pan() {
        let panned = pan(&camera(), [0.25, -0.1]);
        let [x, y] = project(&panned, DVec3::ZERO).expect("in front of the eye");
        assert!((x - 0.25).abs() < 1e-9 && (y + 0.1).abs() < 1e-9, "{x} {y}");
    }

    #[test]
    fn a_wheel_forward_comes_nearer() {
        let nearer = zoom(&camera(), 2.0);
        assert!(near(nearer.eye, [0.0, 0.0, 8.1]), "{nearer:?}");
        assert_eq!(nearer.projection, camera().projection);
        let parallel = Camera {
            projection: Projection::Orthographic { height: 10.0 },
            ..camera()
        };
        let nearer = zoom(&parallel, 2.0);
        assert_eq!(nearer.eye, parallel.eye);
        assert!((height_at_target(&nearer) - 8.1).abs() < 1e-9, "{nearer:?}");
    }

    #[test]
    fn the_keys_1_to_6_show_the_sides_in_the_order_of_the_table_in_readme() {
        let name = |side: &Side| match serde_json::to_value(side) {
            Ok(serde_json::Value::String(name)) => name.replace('-', "−"),
            other => panic!("{other:?}"),
        };
        let names = |axes| named_views(axes).each_ref().map(name);
        let anatomical = names(Some("LPS".parse().expect("axes"))).join(", ");
        let others = names(None).join(" ");
        let row = format!("{anatomical} where they are known, or {others} |");
        assert!(include_str!("../../README.md").contains(&row), "{row}");
    }
}
