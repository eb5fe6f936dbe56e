//! `--set` and the flags that stand for it change the scene under the same checks as the file.

use std::path::Path;

use isolume::error::Error;
use isolume::scene::preset::Preset;
use isolume::scene::volume::Endian;
use isolume::scene::{Edit, SceneFile, Variant, open, resolve};

use super::{edits, message, volume};

#[test]
fn edits_go_through_the_same_checks() {
    let text = "[[surfaces.iso]]\nvalue = 5\n[camera]\neye = [1, 2, 3]";
    let with = |changes: &[&str]| SceneFile::parse(text, Path::new("head.toml"), &edits(changes));
    assert_eq!(
        with(&["surfaces.iso.0.value=900"]).unwrap().surfaces.iso[0].value,
        900.0
    );
    assert_eq!(
        with(&["surfaces.iso[0].value=9.5"]).unwrap().surfaces.iso[0].value,
        9.5
    );
    assert_eq!(
        with(&["surfaces.iso[1].value=6"])
            .unwrap()
            .surfaces
            .iso
            .len(),
        2
    );
    assert_eq!(
        with(&["render.variant=caching"]).unwrap().render.variant,
        Some(Variant::Caching)
    );
    assert_eq!(
        with(&["render.size=[3, 4]"]).unwrap().render.size,
        Some([3, 4])
    );
    assert_eq!(
        with(&["camera.eye.1=7"]).unwrap().camera.eye,
        Some([1.0, 7.0, 3.0])
    );
    let light = with(&["light.0.type=directional", "light.0.direction=[0,0,-2]"]).unwrap();
    assert_eq!(light.light[0].direction, Some([0.0, 0.0, -2.0]));

    let said = |change: &str, says: &str| {
        let message = message(with(&[change]));
        assert!(
            message.starts_with(&format!("--set {change}: ")),
            "{message}"
        );
        assert!(message.contains(says), "{message}");
    };
    said("medium.g=abc", "medium.g: found \"abc\", expected a number");
    said(
        "medum.g=0.5",
        "medum: unknown key; did you mean \"medium\"?",
    );
    said(
        "surfaces.iso.0.opacity=2",
        "surfaces.iso.0.opacity: found 2",
    );
    said("surfaces.iso.3.value=2", "found index 3, expected 0 to 1");
    said(
        "surfaces.iso.first.value=2",
        "found `first`, expected an index",
    );
    said("surfaces.iso.0.value.x=2", "`x` would be inside 5");
    let clear = with(&["surfaces.iso.0.opacity=.2"]).unwrap();
    assert_eq!(clear.surfaces.iso[0].opacity, Some(0.2));
    said(
        "render=[[8, 8]]",
        "render: found [[8, 8]], expected a table",
    );
    // Deeper than the stack: the key is refused before there are as many tables.
    let deep = format!("a{}=1", ".a".repeat(60_000));
    said(&deep, "found a key of 60001 names, expected at most 8");
    for malformed in ["medium.g", "=3", "a..b=3", "surfaces.iso[].value=1"] {
        assert!(malformed.parse::<Edit>().is_err(), "{malformed}");
    }
}

#[test]
fn iso_and_view_flags() {
    let with = |text: &str, edit: Edit| SceneFile::parse(text, Path::new("head.toml"), &[edit]);
    let one = "[[surfaces.iso]]\nvalue = 5\nopacity = 0.5";
    let changed = with(one, Edit::iso(7.0)).unwrap();
    assert_eq!(
        (
            changed.surfaces.iso[0].value,
            changed.surfaces.iso[0].opacity
        ),
        (7.0, Some(0.5))
    );
    assert_eq!(with("", Edit::iso(7.0)).unwrap().surfaces.iso[0].value, 7.0);
    let several = message(with(
        &format!("{one}\n[[surfaces.iso]]\nvalue = 6"),
        Edit::iso(7.0),
    ));
    assert!(
        several.starts_with("--iso 7: the scene has 2 isosurfaces"),
        "{several}"
    );
    let outside = resolve(&with(one, Edit::iso(999.0)).unwrap(), &volume(None));
    assert!(message(outside).starts_with("--iso 999: surfaces.iso.0.value: found 999"));
    let huge = message(with(one, Edit::iso(1e300)));
    assert!(
        huge.starts_with("--iso 1e300: surfaces.iso.0.value: found 1e300"),
        "{huge}"
    );

    let view = isolume::scene::Side::MinusX;
    let placed = "[camera]\neye = [9, 9, 9]\nup = [1, 0, 0]\nfov_y = 30";
    let camera = with(placed, Edit::view(view)).unwrap().camera;
    assert_eq!(
        (camera.eye, camera.up, camera.fov_y),
        (None, None, Some(30.0))
    );
    assert_eq!(camera.view, Some(view));
    // What another flag says still counts.
    let turned = [edits(&["camera.up=[0, 0, 1]"]), vec![Edit::view(view)]].concat();
    let turned = SceneFile::parse(placed, Path::new("head.toml"), &turned).unwrap();
    assert_eq!(turned.camera.up, Some([0.0, 0.0, 1.0]));
}

#[test]
fn open_reads_scene_and_volume() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("head.toml");
    std::fs::write(&path, "[volume]\npath = \"data/head.raw\"\ndims = [10, 20, 10]\ntype = \"uint8\"\n[[surfaces.iso]]\nvalue = 5").unwrap();
    let opened = open(
        &path,
        Preset::Auto,
        &edits(&["volume.endian=big"]),
        |file, overrides| {
            assert_eq!(file, folder.path().join("data/head.raw"));
            assert_eq!(overrides.dims, Some([10, 20, 10]));
            assert_eq!(overrides.endian, Some(Endian::Big));
            Ok(volume(None))
        },
    );
    assert_eq!(opened.unwrap().scene.surfaces.iso[0].value, 5.0);

    let absent = open(
        &folder.path().join("no.toml"),
        Preset::Auto,
        &[],
        |_, _| unreachable!(),
    );
    assert!(message(absent).contains("no.toml"));
    std::fs::write(&path, "[medium]\ng = 3\n").unwrap();
    let early = open(&path, Preset::Auto, &[], |_, _| {
        panic!("read a volume for a bad scene")
    });
    assert!(matches!(early, Err(Error::Input { .. })));
}

/// What a flag sets replaces what the file says instead of it; two flags that do not go together are a mistake.
#[test]
fn a_flag_replaces_its_rivals_in_the_file() {
    let text = "[camera]\neye = [1, 2, 3]\nup = [0, 0, 1]\nfov_y = 30";
    let with = |changes: &[&str]| SceneFile::parse(text, Path::new("head.toml"), &edits(changes));
    let viewed = with(&["camera.view=+x", "camera.orthographic=3"])
        .unwrap()
        .camera;
    assert!(viewed.view.is_some() && viewed.eye.is_none() && viewed.up.is_none());
    assert_eq!((viewed.orthographic, viewed.fov_y), (Some(3.0), None));
    let both = with(&["camera.eye=[4, 5, 6]", "camera.view=+x"]);
    assert!(message(both).contains("found together with eye"));
}
