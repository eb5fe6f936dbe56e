//! `isolume scene` prints what reads back as the same scene.

use std::path::Path;

use isolume::scene::volume::Volume;
use isolume::scene::{SceneFile, describe, resolve};

use super::sky::write_image;
use super::volume;

#[test]
fn a_described_scene_reads_back_as_itself() {
    let folder = tempfile::tempdir().unwrap();
    write_image(folder.path(), "sky \"1\".exr", 4, 2, |i, _| i as f32);
    let text = r#"
[volume]
path = "head.nrrd"
axes = "LPS"
[medium]
density = 0.123456789012345678
g = 1e-7
[[medium.transfer]]
value = 0.1
opacity = 0.0
[[medium.transfer]]
value = 0.3
color = [0.1, 0.2, 0.3]
[surfaces]
light = "full"
normals = "analytic"
[[surfaces.iso]]
value = 3
[[surfaces.iso]]
value = 4
shading = "phong"
shininess = 7
[[surfaces.iso]]
value = 5
shading = "disney"
metallic = 0.7
opacity = 0.3
[[light]]
type = "directional"
direction = [0.3, -1.0, -0.4]
[[light]]
type = "environment"
radiance = [0.1, 0.2, 0.3]
[[light]]
type = "environment"
image = 'sky "1".exr'
radiance = [0.7, 0.2, 0.3]
[[light]]
type = "directional"
direction = [1e-3, 7, 1]
irradiance = [1, 2, 3]
[[clip]]
normal = [1, 1, 1]
offset = 0.7
[camera]
view = "left"
fov_y = 33.3
[render]
size = [640, 480]
cache_scale = 1
cache_format = "f16"
variant = "non-caching"
max_bounces = 3
background = [0.1, 0.2, 0.3]
exposure = -1.5
tone = "filmic"
"#;
    let sparse =
        "[camera]\northographic = 5\n[render]\nbackground = \"transparent\"\ncache_scale = 0.5";
    for text in [text, sparse, ""] {
        let volume = volume(Some("LPS"));
        let file = SceneFile::parse(text, &folder.path().join("head.toml"), &[]).unwrap();
        let (scene, _) = resolve(&file, &volume).unwrap();
        let described = describe(&file, &volume, &scene);
        let again = SceneFile::parse(&described, Path::new("again.toml"), &[]).unwrap();
        let (resolved_again, _) = resolve(&again, &volume).unwrap();
        assert_eq!(resolved_again, scene, "{described}");
        assert_eq!(describe(&again, &volume, &scene), described);
        for key in ["density", "cache_scale", "tone", "spacing", "crop", "fov_y"] {
            let written = described.contains(key);
            assert!(
                written || text.is_empty() || text == sparse,
                "no {key} in {described}"
            );
        }
    }
}

/// As a key, the size of what is left would not fit the file.
#[test]
fn the_size_of_a_cropped_file_is_its_own() {
    let folder = tempfile::tempdir().unwrap();
    std::fs::write(folder.path().join("v_4x3x2_uint8.raw"), [7; 24]).unwrap();
    let text = "[volume]\npath = \"v_4x3x2_uint8.raw\"\ncrop = [[0, 0, 0], [2, 2, 1]]";
    let file = SceneFile::parse(text, &folder.path().join("head.toml"), &[]).unwrap();
    let overrides = file.volume_overrides().unwrap();
    let volume = Volume::load(&file.volume_path().unwrap(), &overrides).unwrap();
    let (scene, _) = resolve(&file, &volume).unwrap();
    let described = describe(&file, &volume, &scene);
    assert!(described.contains("\n# dims = [4, 3, 2] "), "{described}");
    assert_eq!(volume.dims, [2, 2, 1]);
}

/// As when an edit is taken back that came with the scene file's own change.
#[test]
fn a_scene_names_its_own_sky_whatever_the_file_says() {
    let folder = tempfile::tempdir().unwrap();
    let volume = volume(None);
    let [old, new] = ["old.exr", "new.exr"].map(|name| {
        write_image(folder.path(), name, 4, 2, |i, _| i as f32);
        let text = format!("[[light]]\ntype = \"environment\"\nimage = \"{name}\"");
        SceneFile::parse(&text, &folder.path().join("head.toml"), &[]).unwrap()
    });
    let (scene, _) = resolve(&old, &volume).unwrap();
    let described = describe(&new, &volume, &scene);
    assert!(described.contains("old.exr") && !described.contains("new.exr"));
}

/// Comments show the keys that are not set, each with a value that it may have.
#[test]
fn keys_in_comments_are_keys() {
    let volume = volume(None);
    let file = SceneFile::parse("", Path::new("head.toml"), &[]).unwrap();
    let (scene, _) = resolve(&file, &volume).unwrap();
    let described = describe(&file, &volume, &scene);
    let shown = |line: &str| -> Option<String> {
        let line = line.strip_prefix("# ")?;
        let is_key = line.starts_with('[') || line.split(' ').nth(1) == Some("=");
        is_key.then(|| line.to_string())
    };
    // In the place of these two, comments show others.
    let is_replaced = |line: &&str| line.starts_with("eye =") || line.starts_with("fov_y =");
    let all: Vec<String> = described
        .lines()
        .filter(|line| !is_replaced(line))
        .map(|line| shown(line).unwrap_or(line.to_string()))
        .collect();
    let all = SceneFile::parse(&all.join("\n"), Path::new("all.toml"), &[]).unwrap();
    let (table, camera) = (&all.volume, &all.camera);
    assert!(table.series.is_some() && table.fill_gaps.is_some() && table.endian.is_some());
    assert!(table.channel.is_some() && table.time.is_some() && table.level.is_some());
    assert!(camera.view.is_some() && camera.orthographic.is_some());
    assert_eq!((all.clip.len(), all.surfaces.iso.len()), (1, 1));
    assert_eq!(all.medium.map(|medium| medium.transfer.len()), Some(1));
    let [sun, sky] = &all.light[..] else {
        panic!("{described}");
    };
    assert!(sun.irradiance.is_some() && sky.image.is_some());
}
