//! Scenes: an input is a scene file in which lines that begin with `--set` or `--iso` are changes by the command line, or
//! such changes of a bare volume and a preset.

#![no_main]

use std::sync::LazyLock;

use isolume::scene::preset::Preset;
use isolume::scene::volume::{Volume, Voxels};
use isolume::scene::{Edit, SceneFile, Side, describe, open, resolve};
use isolume_fuzz::{folder, guard, pictures, target};

static VOLUME: LazyLock<Volume> = LazyLock::new(|| {
    let values = (0..24).map(|n| 0.5 * n as f32).collect();
    Volume::from_values([4, 3, 2], [1.0, 1.0, 2.0], Voxels::F32(values)).expect("a volume")
});

const SEEDS: [&str; 6] = [
    concat!("0", include_str!("scene.toml")),
    "0--set camera.view=anterior\n--set render.size=[64, 48]\n--iso 3\n",
    "1--set volume.spacing=[1,1,1]\n--set medium.transfer.3.value=9\n--iso 2e1\n",
    "2--set light[0].radiance=[1,2,3]\n--set clip.0.normal=[1,0,0]\n--set surfaces.iso[0].shading=disney\n",
    "0[[light]]\ntype = \"environment\"\nimage = \"sky.hdr\"\nradiance = [2, 1, 1]\n[[light]]\ntype='environment'\n",
    "0[render]\nvariant = \"caching\"\ncache_scale = 0.5\ncache_format = \"f16\"\nbackground = [0.1, 0.2, 0.3]\n",
];

fn seeds() -> Vec<Vec<u8>> {
    folder::write("sky.hdr", &pictures::hdr());
    SEEDS.map(|text| text.as_bytes().to_vec()).into()
}

fn allowed(bytes: usize) -> usize {
    (4 << 20) + 4096 * bytes
}

fn parse(bytes: &[u8]) {
    let Ok(text) = str::from_utf8(bytes) else {
        return;
    };
    let preset = match text.chars().next() {
        Some('0') => None,
        Some('1') => Some(Preset::Auto),
        Some('2') => Some(Preset::Ct),
        _ => return,
    };
    let mut edits = Vec::new();
    let mut file = String::new();
    for line in text[1..].lines() {
        if let Some(set) = line.strip_prefix("--set ") {
            edits.extend(set.parse::<Edit>());
        } else if let Some(iso) = line.strip_prefix("--iso ") {
            edits.extend(iso.parse().map(Edit::iso));
        } else if line == "--view top" {
            edits.push(Edit::view(Side::Superior));
        } else {
            file += line;
            file.push('\n');
        }
    }
    let allowed = allowed(bytes.len());
    match preset {
        Some(preset) => {
            let volume = folder::path("v.nrrd");
            let opened = guard::run(allowed, || {
                open(&volume, preset, &edits, |_, _| Ok(VOLUME.clone()))
            });
            if let Ok(opened) = opened {
                check(&opened.file, &opened.scene);
            }
        }
        None => {
            let path = folder::path("scene.toml");
            let read = guard::run(allowed, || {
                let file = SceneFile::parse(&file, &path, &edits).ok()?;
                let _ = file.volume_path();
                let _ = file.volume_overrides();
                let (scene, _) = resolve(&file, &VOLUME).ok()?;
                Some((file, scene))
            });
            if let Some((file, scene)) = read {
                check(&file, &scene);
            }
        }
    }
}

/// A scene that is printed and read again is the same one.
fn check(file: &SceneFile, scene: &isolume::scene::Scene) {
    let text = describe(file, &VOLUME, scene);
    let again = SceneFile::parse(&text, "again.toml".as_ref(), &[]);
    let again = again.and_then(|file| Ok(resolve(&file, &VOLUME)?.0));
    match again {
        Ok(again) => assert_eq!(&again, scene, "{text}"),
        Err(error) => panic!("{error}\n{text}"),
    }
}

target!(seeds, parse);
