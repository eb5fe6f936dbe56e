//! Prints a resolved scene as a scene file: every key, with its unit in a comment; those that are not set as comments.
//! Reading it again gives the same scene to the last bit, so it is also stored in an EXR's header.

use super::SceneFile;
use super::camera::describe_camera;
use super::clips::describe_clips;
use super::lights::describe_lights;
use super::medium::describe_medium;
use super::page::Page;
use super::render::describe_render;
use super::surfaces::describe_surfaces;
use super::volume::describe_volume;
use crate::scene::volume::Volume;
use crate::scene::{Medium, Scene, TransferPoint};

/// Prints a scene. `file` has the paths, which a resolved scene does not need. They are printed relative to the
/// current directory.
pub fn describe(file: &SceneFile, volume: &Volume, scene: &Scene) -> String {
    let mut page = Page::default();
    for line in [
        "The scene with its defaults filled in; lines such as `# series = 1` show keys that are not set.",
        "Colours are linear Rec. 709, lengths are world units (those of the volume's spacing), values are",
        "the data's own. Paths are relative to this file's folder: as printed, to that where isolume ran.",
    ] {
        page.comment(line);
    }
    describe_volume(&mut page, file, volume);
    match &scene.medium {
        Some(medium) => describe_medium(&mut page, medium),
        None => page.unset(|page| describe_medium(page, &example_medium(volume))),
    }
    describe_surfaces(&mut page, scene, volume);
    describe_lights(&mut page, &scene.lights);
    describe_clips(&mut page, &scene.clips);
    describe_camera(&mut page, &scene.camera);
    describe_render(&mut page, &scene.render);
    page.text
}

/// A medium for a scene that has none.
fn example_medium(volume: &Volume) -> Medium {
    let point = TransferPoint {
        value: volume.range[1],
        opacity: 1.0,
        color: [1.0; 3],
    };
    Medium::isotropic(Medium::default_density(volume.extent()), vec![point])
}
