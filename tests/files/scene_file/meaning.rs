//! What a valid scene file means: its defaults, and what a picture of it would show.

use std::path::Path;

use glam::DVec3;
use isolume::scene::volume::{Endian, Pick, VoxelType};
use isolume::scene::{
    Background, CacheFormat, CacheScale, Disney, LightModel, Normals, Projection, Shading, Tone,
    Variant, resolve,
};

use super::{message, parse, resolved, volume};

#[test]
fn defaults_are_those_of_the_contract() {
    let (scene, notes) =
        resolved("[[medium.transfer]]\nvalue = 3\n[[surfaces.iso]]\nvalue = 7").unwrap();
    let medium = scene.medium.unwrap();
    assert_eq!(medium.density, 50.0 / 200.0);
    assert_eq!(medium.g, 0.0);
    assert_eq!(medium.transfer[0].opacity, 1.0);
    assert_eq!(medium.transfer[0].color, [1.0; 3]);
    assert_eq!(scene.surfaces.light, LightModel::Local);
    assert_eq!(scene.surfaces.normals, Normals::Smooth);
    assert_eq!(scene.surfaces.iso[0].shading, Shading::Lambert);
    assert_eq!(scene.surfaces.iso[0].color, [0.8; 3]);
    assert_eq!(scene.surfaces.iso[0].opacity, 1.0);
    assert_eq!(scene.lights.environment.radiance, [1.0; 3]);
    assert_eq!(scene.lights.environment.image, None);
    assert!(scene.lights.suns.is_empty() && scene.clips.is_empty() && notes.is_empty());
    assert_eq!(
        scene.camera.projection,
        Projection::Perspective { fov_y: 40.0 }
    );
    assert_eq!(scene.camera.target, [0.0; 3]);
    let render = scene.render;
    assert_eq!((render.size, render.max_bounces), ([1024, 1024], 0));
    assert_eq!(
        (render.variant, render.cache_scale),
        (Variant::Auto, CacheScale::Auto)
    );
    assert_eq!(
        (render.cache_format, render.tone),
        (CacheFormat::Auto, Tone::Linear)
    );
    assert_eq!(
        (render.background, render.exposure),
        (Background::Environment, 0.0)
    );
}

#[test]
fn shading_defaults_are_those_of_the_contract() {
    let shading = |name: &str| {
        let text = format!("[[surfaces.iso]]\nvalue = 7\nshading = \"{name}\"");
        resolved(&text).unwrap().0.surfaces.iso[0].shading
    };
    assert_eq!(
        shading("phong"),
        Shading::Phong {
            specular: 0.5,
            shininess: 32.0
        }
    );
    let expected = Shading::Disney(Disney {
        metallic: 0.0,
        roughness: 0.5,
        specular: 0.5,
        specular_tint: 0.0,
        sheen: 0.0,
        sheen_tint: 0.5,
        subsurface: 0.0,
        clearcoat: 0.0,
        clearcoat_gloss: 1.0,
    });
    assert_eq!(shading("disney"), expected);
}

#[test]
fn the_contract_example_is_accepted() {
    let text = r#"
[volume]
path = "head.nrrd"
channel = 1
time = 2
level = 0
dims = [512, 512, 460]
type = "uint16"
endian = "little"
spacing = [0.5, 0.5, 1.0]
axes = "LPI"
crop = [[0,0,0],[256,256,128]]
[medium]
density = 0.4
g = 0.0
[[medium.transfer]]
value = 100.0
opacity = 0.0
color = [0.9, 0.8, 0.7]
[[medium.transfer]]
value = 200
[surfaces]
light = "local"
normals = "smooth"
[[surfaces.iso]]
value = 150.0
shading = "lambert"
color = [0.9, 0.85, 0.75]
[[light]]
type = "directional"
direction = [0.3, -1.0, -0.4]
irradiance = [3.0, 3.0, 3.0]
[[light]]
type = "environment"
radiance = [1.0, 1.0, 1.0]
[[clip]]
normal = [2.0, 0.0, 0.0]
offset = 8.0
[camera]
eye = [0.0, 0.0, 400.0]
target = [0.0, 0.0, 0.0]
up = [0.0, 1.0, 0.0]
fov_y = 40.0
[render]
size = [1024, 1024]
max_bounces = 0
variant = "auto"
cache_scale = "auto"
cache_format = "auto"
background = "environment"
exposure = 0.0
tone = "linear"
"#;
    let file = parse(text).unwrap();
    assert_eq!(file.volume_path().unwrap(), Path::new("scenes/head.nrrd"));
    let overrides = file.volume_overrides().unwrap();
    assert_eq!(overrides.dims, Some([512, 512, 460]));
    let picked = [overrides.channel, overrides.time, overrides.level];
    assert_eq!(picked, [Some(1), Some(2), Some(0)]);
    assert_eq!(overrides.voxel_type, Some(VoxelType::U16));
    assert_eq!(overrides.endian, Some(Endian::Little));
    assert_eq!(overrides.axes.unwrap().to_string(), "LPI");
    let (scene, notes) = resolve(&file, &volume(None)).unwrap();
    assert!(notes.is_empty(), "{notes:?}");
    let travels = DVec3::from(scene.lights.suns[0].direction);
    assert!((travels.length() - 1.0).abs() < 1e-15);
    assert!(travels.dot(DVec3::new(0.3, -1.0, -0.4).normalize()) > 1.0 - 1e-15);
    assert_eq!(
        (scene.clips[0].normal, scene.clips[0].offset),
        ([1.0, 0.0, 0.0], 4.0)
    );
    assert_eq!(scene.camera.eye, [0.0, 0.0, 400.0]);
}

#[test]
fn what_cannot_be_seen_is_said() {
    let says = |text: &str, says: &str| {
        let message = message(resolved(text));
        assert!(
            message.starts_with("scenes/head.toml:") && message.contains(says),
            "{message}"
        );
    };
    let ramp = |a, b| {
        format!("[[medium.transfer]]\nvalue = {a}\nopacity = 0\n[[medium.transfer]]\nvalue = {b}")
    };
    says(
        &ramp(300, 400),
        "opacity starts at 300, the data end at 254",
    );
    says(
        &ramp(254, 400),
        "opacity starts at 254, the data end at 254",
    );
    let falling = "[[medium.transfer]]\nvalue = -9\n[[medium.transfer]]\nvalue = -3\nopacity = 0";
    says(falling, "opacity ends at -3, the data start at 0");
    says(
        "[[medium.transfer]]\nvalue = 3\nopacity = 0",
        "opacity is 0 at every point",
    );
    let gap = "[[medium.transfer]]\nvalue = -9\n[[medium.transfer]]\nvalue = -3\nopacity = 0\n\
               [[medium.transfer]]\nvalue = 300\nopacity = 0\n[[medium.transfer]]\nvalue = 301";
    says(gap, "opacity is 0 everywhere from 0 to 254");
    says(
        "[[surfaces.iso]]\nvalue = 254.5",
        "surfaces.iso.0.value: found 254.5, but the data go from 0 to 254",
    );
    says(
        "[[surfaces.iso]]\nvalue = -1",
        "surfaces.iso.0.value: found -1",
    );

    let noted = |text: &str, part: &str| {
        let (_, notes) = resolved(text).unwrap();
        assert!(notes.iter().any(|note| note.contains(part)), "{notes:?}");
    };
    noted(
        &format!("{}\n[[surfaces.iso]]\nvalue = 9", ramp(300, 400)),
        "opacity starts at 300",
    );
    noted("", "the picture is the background alone");
    noted(
        "[medium]\ndensity = 0\n[[medium.transfer]]\nvalue = 900",
        "background alone",
    );
    noted("[[surfaces.iso]]\nvalue = 0", "this isosurface is empty");
    noted(
        "[[surfaces.iso]]\nvalue = 9\nshininess = 3",
        "head.toml:3: surfaces.iso.0.shininess: has no effect with lambert",
    );
    noted(
        "[render]\nvariant = \"non-caching\"\ncache_scale = 0.5",
        "head.toml:3: render.cache_scale: has no effect with variant \"non-caching\"",
    );
    assert!(resolved(&ramp(253, 400)).is_ok());
    assert!(resolved(&ramp(-5, 300)).is_ok());
}

#[test]
fn a_series_is_a_number_or_a_uid() {
    let overrides = |text: &str| {
        parse(&format!("[volume]\n{text}"))
            .unwrap()
            .volume_overrides()
            .unwrap()
    };
    assert_eq!(overrides("").series, None);
    assert_eq!(overrides("series = 2").series, Some(Pick::Number(2)));
    let uid = overrides("series = \"1.2.840\"\nfill_gaps = true");
    assert_eq!(uid.series, Some(Pick::Uid("1.2.840".into())));
    assert!(uid.fill_gaps && !overrides("").fill_gaps);
    for wrong in ["0", "-1", "1.5", "[1]"] {
        let said = message(parse(&format!("[volume]\nseries = {wrong}")));
        assert!(
            said.contains("a number from 1 to 4294967295 or a SeriesInstanceUID"),
            "{said}"
        );
    }
}
