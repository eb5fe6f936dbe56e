//! Whatever key of a scene is edited, the picture is that of a new engine: nothing stale is left in it.
//!
//! The keys are those that the scene file's own types know, as their messages list them, so a new key that is
//! missing here fails the test. The volume's keys are left out: another volume is another engine.

use std::num::NonZeroU32;
use std::path::Path;

use isolume::engine::{Changed, Engine, Picture, SampleRange, Samples, Stop};
use isolume::scene::volume::Volume;
use isolume::scene::{Edit, Scene, SceneFile, describe, resolve};
use toml::{Table, Value};

use crate::support::common::watched_host;
use crate::support::fields::field;

/// A scene whose cache is filled with what surfaces reflect, and which has every part that can be edited.
pub const CACHED: &str = r#"
[medium]
density = 0.3
g = 0.3
transfer = [
    { value = 10.0, opacity = 0.1, color = [0.9, 0.8, 0.7] },
    { value = 90.0, opacity = 0.8, color = [0.6, 0.8, 0.9] },
]
[surfaces]
light = "full"
[[surfaces.iso]]
value = 40.0
opacity = 0.5
shading = "phong"
[[light]]
type = "directional"
direction = [0.3, -1.0, -0.4]
irradiance = [3.0, 2.0, 1.0]
[[light]]
type = "environment"
radiance = [0.2, 0.3, 0.5]
[[clip]]
normal = [1.0, 0.2, 0.0]
offset = 5.0
[camera]
eye = [14.0, 11.0, 22.0]
target = [0.0, 0.0, 0.0]
up = [0.0, 1.0, 0.0]
fov_y = 40.0
[render]
size = [12, 10]
variant = "auto"
cache_scale = 0.5
cache_format = "f16"
"#;

/// A scene without a cache, and with a material that has all parameters.
const GLOSSY: &str = r#"
[[surfaces.iso]]
value = 60.0
shading = "disney"
metallic = 0.2
specular_tint = 0.1
sheen = 0.1
subsurface = 0.1
clearcoat = 0.1
[[light]]
type = "directional"
direction = [0.3, -1.0, -0.4]
irradiance = [3.0, 2.0, 1.0]
[render]
size = [12, 10]
"#;

/// Edits of `GLOSSY`.
const OF_GLOSSY: &[&str] = &[
    "surfaces.iso.0.roughness=0.2",
    "surfaces.iso.0.metallic=0.7",
    "surfaces.iso.0.specular_tint=0.9",
    "surfaces.iso.0.sheen=0.9",
    "surfaces.iso.0.sheen_tint=0.9",
    "surfaces.iso.0.subsurface=0.9",
    "surfaces.iso.0.clearcoat=0.9",
    "surfaces.iso.0.clearcoat_gloss=0.2",
    "surfaces.iso.0.value=50.0",
    "surfaces.iso.0.color=[0.9, 0.2, 0.1]",
    "surfaces.normals=\"analytic\"",
    "light.0.direction=[1.0, -1.0, -0.4]",
    "light.0.irradiance=[1.0, 2.0, 4.0]",
];

/// Edits of `CACHED`: for each key of the scene file, another value. A key that excludes another one comes as its
/// whole table.
pub const OF_CACHED: &[&str] = &[
    "medium.density=0.5",
    "medium.g=0.5",
    "medium.transfer.0.value=20.0",
    "medium.transfer.0.opacity=0.4",
    "medium.transfer.0.color=[0.3, 0.8, 0.7]",
    "surfaces.light=\"local\"",
    "surfaces.normals=\"analytic\"",
    "surfaces.iso.0.value=50.0",
    "surfaces.iso.0.opacity=0.8",
    "surfaces.iso.0.shading=\"lambert\"",
    "surfaces.iso.0.color=[0.9, 0.2, 0.1]",
    "surfaces.iso.0.specular=0.9",
    "surfaces.iso.0.shininess=5.0",
    "light.0={ type = \"environment\", radiance = [0.5, 0.5, 0.5] }",
    "light.0.direction=[1.0, -1.0, -0.4]",
    "light.0.irradiance=[1.0, 2.0, 4.0]",
    "light.1.radiance=[0.6, 0.3, 0.1]",
    "light.1.image=\"sky.png\"",
    "clip.0.normal=[0.0, 1.0, 0.3]",
    "clip.0.offset=2.0",
    "camera.eye=[-14.0, 3.0, 20.0]",
    "camera={ view = \"+x\", fov_y = 40.0 }",
    "camera.target=[1.0, 2.0, 0.0]",
    "camera.up=[0.3, 1.0, 0.0]",
    "camera.fov_y=25.0",
    "camera={ eye = [14.0, 11.0, 22.0], orthographic = 18.0 }",
    "render.size=[10, 14]",
    "render.max_bounces=2",
    "render.variant=\"non-caching\"",
    "render.cache_scale=0.25",
    "render.cache_format=\"f32\"",
    "render.background=[0.1, 0.2, 0.3]",
    "render.exposure=1.0",
    "render.tone=\"filmic\"",
];

/// A scene whose medium does not reach the faces of a box of 40³ voxels.
const INSIDE: &str = r#"
[medium]
density = 0.2
transfer = [{ value = 50.0, opacity = 0.0 }, { value = 60.0, opacity = 1.0 }]
[render]
size = [12, 10]
cache_scale = 1
cache_format = "f16"
"#;

/// A ball of radius 9 in a box of so many voxels along each side.
fn ball(side: u32) -> Volume {
    field([side; 3], [1.0; 3], |p| {
        let value = 100.0 - 11.0 * p.length() + 6.0 * (p.x * 0.9).sin();
        value.clamp(0.0, 100.0) as f32
    })
}

pub fn volume() -> Volume {
    ball(16)
}

/// A sky in a folder of its own, which the scene's relative paths begin at.
pub fn folder() -> tempfile::TempDir {
    let folder = tempfile::tempdir().expect("a folder");
    let texel = |x: u32, y: u32| image::Rgb([(40 * x) as u8, (60 * y) as u8, 200]);
    let sky = image::RgbImage::from_fn(6, 4, texel);
    sky.save(folder.path().join("sky.png")).expect("a sky");
    folder
}

pub fn scene(text: &str, folder: &Path, edits: &[&str], volume: &Volume) -> Scene {
    let file = parse(text, folder, edits).unwrap_or_else(|error| panic!("{edits:?}: {error}"));
    let resolved = resolve(&file, volume);
    resolved
        .unwrap_or_else(|error| panic!("{edits:?}: {error}"))
        .0
}

fn parse(text: &str, folder: &Path, edits: &[&str]) -> isolume::error::Result<SceneFile> {
    let edits: Vec<Edit> = edits.iter().map(|e| e.parse().expect("an edit")).collect();
    SceneFile::parse(text, &folder.join("scene.toml"), &edits)
}

/// The keys of a table, as the message about an unknown one lists them.
fn keys_of(table: &str) -> Vec<String> {
    let unknown = match table {
        "" => "nonsense=1".to_string(),
        table => format!("{table}.nonsense=1"),
    };
    let message = match parse(CACHED, Path::new("."), &[&unknown]) {
        Err(error) => error.to_string(),
        Ok(_) => panic!("{unknown} is known"),
    };
    let list = message.rsplit("it can be ").next().map(str::to_string);
    let list = list.filter(|l| l.len() < message.len());
    let list = list.or_else(|| message.rsplit("It can be ").next().map(str::to_string));
    let list = list.expect("a list of keys");
    list.split(", ").map(|key| key.trim().to_string()).collect()
}

/// Every key of the scene file, without numbers.
fn all_keys() -> Vec<String> {
    let tables = [
        ("medium", "medium"),
        ("medium.transfer.0", "medium.transfer"),
        ("surfaces", "surfaces"),
        ("surfaces.iso.0", "surfaces.iso"),
        ("light.0", "light"),
        ("clip.0", "clip"),
        ("camera", "camera"),
        ("render", "render"),
    ];
    let is_table = |key: &str| tables.iter().any(|(_, name)| *name == key);
    for key in keys_of("") {
        assert!(
            is_table(&key) || key == "volume",
            "the table {key} is not edited"
        );
    }
    let keys = tables.iter().flat_map(|(path, name)| {
        let keys = keys_of(path).into_iter();
        keys.map(move |key| format!("{name}.{key}"))
    });
    keys.filter(|key| !is_table(key)).collect()
}

/// The keys that an edit of a scene sets to another value, without numbers.
fn keys_changed_by(edit: &str, scene: &Table) -> Vec<String> {
    let (path, value) = edit.split_once('=').expect("an edit");
    let after: Value = value.parse().expect("a value");
    let mut words = path.split('.');
    let table = words.next().and_then(|word| scene.get(word));
    let before = words.fold(table, |outer, word| match word.parse::<usize>() {
        Ok(index) => outer?.get(index),
        Err(_) => outer?.get(word),
    });
    let is_name = |word: &&str| word.parse::<usize>().is_err();
    let names: Vec<&str> = path.split('.').filter(is_name).collect();
    let mut keys = Vec::new();
    collect_changed(names.join("."), before, &after, &mut keys);
    keys
}

/// Collects a key if its value is another one now; of a table, the keys in it.
fn collect_changed(key: String, before: Option<&Value>, after: &Value, keys: &mut Vec<String>) {
    if let Value::Table(table) = after {
        for (name, after) in table {
            let before = before.and_then(|table| table.get(name));
            collect_changed(format!("{key}.{name}"), before, after, keys);
        }
    } else if before != Some(after) {
        keys.push(key);
    }
}

/// The picture after so many paths a node, the same for all, and so few samples that pictures of all sizes have the same
/// paths.
fn render(engine: &mut Engine) -> Picture {
    engine.serve_all_views();
    let samples = NonZeroU32::new(2).expect("some");
    engine.render(Stop::at_samples(samples)).expect("a picture");
    engine.picture().expect("a picture")
}

/// What is saved as the picture must have all of its pixels.
#[test]
fn samples_of_fewer_pixels_are_no_picture() {
    let folder = folder();
    let host = watched_host();
    let volume = volume();
    let scene = scene(GLOSSY, folder.path(), &[], &volume);
    let mut engine = Engine::new(&host, &volume, &scene, 1).expect("an engine");
    assert!(!engine.has_picture());
    render(&mut engine);
    assert!(engine.has_picture());
    let sampled = |engine: &mut Engine| {
        while !engine.advance_unit(1).expect("a slice") {}
        engine.has_picture()
    };
    engine.reduce_to([3, 2]).expect("fewer pixels");
    assert!(!sampled(&mut engine));
    engine.reduce_to(scene.render.size).expect("all pixels");
    assert!(!engine.has_picture());
    assert!(sampled(&mut engine));
    drop(engine);
    host.check_validation().expect("silence");
}

#[test]
fn a_shard_has_the_samples_that_were_asked_for() {
    let folder = folder();
    let host = watched_host();
    let volume = volume();
    let scene = scene(GLOSSY, folder.path(), &[], &volume);
    let shard = |first, end| {
        let mut engine = Engine::new(&host, &volume, &scene, 1).expect("an engine");
        let stop = Stop {
            samples: Some(Samples::Shard(SampleRange { first, end })),
            ..Stop::default()
        };
        engine.render(stop).expect("a picture");
        assert_eq!(
            (engine.totals().first_sample, engine.totals().samples),
            (first, end - first)
        );
        engine.picture().expect("a picture").rgb
    };
    assert!(shard(2, 4) != shard(0, 2));
    host.check_validation().expect("silence");
}

#[test]
fn every_key_is_edited() {
    let mut edited = Vec::new();
    for (text, edits) in [(CACHED, OF_CACHED), (GLOSSY, OF_GLOSSY)] {
        let scene: Table = text.parse().expect("a scene");
        edited.extend(edits.iter().flat_map(|edit| keys_changed_by(edit, &scene)));
    }
    for key in all_keys() {
        assert!(edited.contains(&key), "{key} is not edited");
    }
}

/// Pictures, shards and checkpoints are told apart by the scene as it is printed.
#[test]
fn every_edit_is_printed() {
    let (folder, volume) = (folder(), volume());
    let printed = |text, edits: &[&str]| {
        let file = parse(text, folder.path(), edits).expect("a scene");
        let (scene, _) = resolve(&file, &volume).expect("a scene");
        describe(&file, &volume, &scene)
    };
    for (text, edits) in [(CACHED, OF_CACHED), (GLOSSY, OF_GLOSSY)] {
        for edit in edits {
            assert_ne!(printed(text, &[edit]), printed(text, &[]), "{edit}");
        }
    }
}

/// After each edit, and after going back to `text`, the picture is that of a new engine. An edit for which other
/// passes or other memory are needed makes a new engine by itself. Returns those.
fn assert_nothing_stale<'a>(text: &str, edits: &[&'a str], volume: Volume) -> Vec<&'a str> {
    let folder = folder();
    let host = watched_host();
    let before = scene(text, folder.path(), &[], &volume);
    let begin = |scene: &Scene| Engine::new(&host, &volume, scene, 1).expect("an engine");
    let mut engine = begin(&before);
    let unedited = render(&mut engine);
    let mut not_in_place = Vec::new();
    for edit in edits {
        let edited = scene(text, folder.path(), &[edit], &volume);
        if engine.change_in_place(&edited).expect("a change") == Changed::Impossible {
            not_in_place.push(*edit);
            continue;
        }
        assert_same(edit, &render(&mut engine), &render(&mut begin(&edited)));
        let back = engine.change_in_place(&before).expect("a change back");
        assert_ne!(
            back,
            Changed::Impossible,
            "there is no way back from {edit}"
        );
        assert_same(&format!("{edit} and back"), &render(&mut engine), &unedited);
    }
    drop(engine);
    host.check_validation().expect("silence");
    not_in_place
}

/// But for the standard error, which holds that of the cache: how well it is known depends on the views in which it was
/// measured.
fn assert_same(edit: &str, changed: &Picture, fresh: &Picture) {
    assert_eq!(changed.rgb, fresh.rgb, "after {edit}");
    assert_eq!(changed.alpha, fresh.alpha, "after {edit}");
    assert_eq!(changed.albedo, fresh.albedo, "after {edit}");
    assert_eq!(changed.normal, fresh.normal, "after {edit}");
    assert_eq!(changed.depth, fresh.depth, "after {edit}");
}

#[test]
fn an_edit_with_a_cache_leaves_nothing_stale() {
    let not_in_place = assert_nothing_stale(CACHED, OF_CACHED, volume());
    let others = [
        "medium.g=0.5",
        "surfaces.light=\"local\"",
        "surfaces.normals=\"analytic\"",
        "surfaces.iso.0.shading=\"lambert\"",
        "light.0={ type = \"environment\", radiance = [0.5, 0.5, 0.5] }",
        "light.1.image=\"sky.png\"",
        "camera={ eye = [14.0, 11.0, 22.0], orthographic = 18.0 }",
        "render.max_bounces=2",
        "render.variant=\"non-caching\"",
        "render.cache_scale=0.25",
        "render.cache_format=\"f32\"",
        "render.background=[0.1, 0.2, 0.3]",
    ];
    assert_eq!(not_in_place, others);
}

#[test]
fn an_edit_of_a_material_leaves_nothing_stale() {
    let not_in_place = assert_nothing_stale(GLOSSY, OF_GLOSSY, volume());
    assert_eq!(not_in_place, ["surfaces.normals=\"analytic\""]);
}

/// In the dark no cache is of use, so that `auto` takes none; it is planned for as soon as a light shines.
#[test]
fn an_edit_that_brings_light_makes_a_cache_possible() {
    let light = "[[light]]\ntype = \"environment\"\nradiance = [0.0, 0.0, 0.0]";
    let edits = ["light.0.radiance=[0.5, 0.5, 0.5]", "medium.density=0.3"];
    let dark = format!("{INSIDE}{light}");
    assert_eq!(assert_nothing_stale(&dark, &edits, ball(40)), [edits[0]]);
}

/// Where the medium meets a face, cubes at the rim are left to paths, which other passes do.
#[test]
fn an_edit_by_which_the_medium_meets_the_faces_leaves_nothing_stale() {
    let edits = ["medium.transfer.0.opacity=0.5", "medium.density=0.15"];
    assert_eq!(assert_nothing_stale(INSIDE, &edits, ball(40)), [edits[0]]);
}
