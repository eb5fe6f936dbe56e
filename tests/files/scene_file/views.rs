//! Named views and the camera that frames the box.

use glam::DVec3;
use isolume::scene::resolve;

use super::{message, parse, resolved, volume};

/// (towards the eye, up, right) of a view.
fn frame(axes: Option<&str>, view: Option<&str>) -> [DVec3; 3] {
    let text = view.map_or(String::new(), |view| format!("[camera]\nview = \"{view}\""));
    let (scene, _) = resolve(&parse(&text).unwrap(), &volume(axes)).unwrap();
    let eye = DVec3::from(scene.camera.eye);
    let back = eye / eye.length();
    let up = DVec3::from(scene.camera.up);
    [back, up, up.cross(back)]
}

#[test]
fn anatomical_views_face_the_patient() {
    // Unit vectors towards left, posterior and superior for each orientation of the axes.
    let (x, y, z) = (DVec3::X, DVec3::Y, DVec3::Z);
    for (axes, left, posterior, superior) in [
        ("LPS", x, y, z),
        ("RAS", -x, -y, z),
        ("PIR", -z, x, -y),
        ("SLP", y, z, x),
    ] {
        let view = |name| frame(Some(axes), Some(name));
        assert_eq!(view("anterior"), [-posterior, superior, left], "{axes}");
        assert_eq!(frame(Some(axes), None), view("anterior"), "{axes}");
        assert_eq!(view("posterior"), [posterior, superior, -left], "{axes}");
        assert_eq!(view("left"), [left, superior, posterior], "{axes}");
        assert_eq!(view("right"), [-left, superior, -posterior], "{axes}");
        // Radiology: anterior on top; from below, the patient's left is on the right.
        assert_eq!(view("superior"), [superior, -posterior, -left], "{axes}");
        assert_eq!(view("inferior"), [-superior, -posterior, left], "{axes}");
    }
}

#[test]
fn axis_views_need_no_anatomy() {
    let (x, y, z) = (DVec3::X, DVec3::Y, DVec3::Z);
    assert_eq!(frame(None, None), [z, y, x]);
    assert_eq!(frame(None, Some("-z")), [-z, y, -x]);
    assert_eq!(frame(None, Some("+x")), [x, y, -z]);
    assert_eq!(frame(None, Some("-x")), [-x, y, z]);
    assert_eq!(frame(None, Some("+y")), [y, -z, x]);
    assert_eq!(frame(None, Some("-y")), [-y, z, x]);
    let above = resolved("[camera]\neye = [0, 90, 0]").unwrap().0.camera;
    assert_eq!(
        above.up,
        [0.0, 0.0, -1.0],
        "+y is up, but not when looking along it"
    );
}

#[test]
fn the_default_camera_frames_the_whole_box() {
    for (view, size) in [
        ("+z", "[400, 100]"),
        ("+x", "[100, 400]"),
        ("-y", "[64, 64]"),
    ] {
        let text = format!("[camera]\nview = \"{view}\"\n[render]\nsize = {size}");
        let (scene, _) = resolved(&text).unwrap();
        let camera = scene.camera;
        let back = DVec3::from(camera.eye).normalize();
        let up = DVec3::from(camera.up);
        let tangent = 20f64.to_radians().tan();
        let aspect = f64::from(scene.render.size[0]) / f64::from(scene.render.size[1]);
        let mut reach: f64 = 0.0;
        for corner in 0..8 {
            let side = |axis: u32, half: f64| if corner >> axis & 1 == 1 { half } else { -half };
            let point = DVec3::new(side(0, 50.0), side(1, 100.0), side(2, 25.0));
            let seen = point - DVec3::from(camera.eye);
            let depth = -seen.dot(back);
            assert!(depth > 0.0);
            let vertical = seen.dot(up).abs() / (depth * tangent);
            let horizontal = seen.dot(up.cross(back)).abs() / (depth * tangent * aspect);
            reach = reach.max(vertical).max(horizontal);
        }
        assert!((0.94..0.96).contains(&reach), "{view}: {reach}");
    }
    let text = "[camera]\nview = \"+z\"\northographic = 300";
    let camera = resolved(text).unwrap().0.camera;
    assert!(
        camera.eye[2] > 25.0,
        "the eye's plane lies in front of the box"
    );
}

#[test]
fn views_that_cannot_be() {
    let parallel = message(resolved("[camera]\nview = \"+y\"\nup = [0, -1, 0]"));
    assert!(parallel.contains("head.toml:3: camera.up"), "{parallel}");
    let unknown = message(resolved("[camera]\nview = \"anterior\""));
    assert!(unknown.contains("head.toml:2: camera.view"), "{unknown}");
    assert!(unknown.contains("orientation is unknown"), "{unknown}");
}
