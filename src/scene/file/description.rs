//! Prints a resolved scene as a scene file: every key, with its unit in a comment. Reading it again gives the same
//! scene to the last bit, so it is also stored in an EXR's header.

use super::SceneFile;
use super::camera::describe_camera;
use super::clips::describe_clips;
use super::lights::describe_lights;
use super::medium::describe_medium;
use super::page::Page;
use super::render::describe_render;
use super::surfaces::describe_surfaces;
use super::volume::describe_volume;
use crate::scene::Scene;
use crate::scene::volume::Volume;

/// Prints a scene. `file` has the paths, which a resolved scene does not need. They are printed relative to the
/// current directory.
pub fn describe(file: &SceneFile, volume: &Volume, scene: &Scene) -> String {
    let mut page = Page::default();
    page.comment(
        "Every key of the scene, defaults filled in. Colours are linear Rec. 709, lengths",
    );
    page.comment("are world units (those of the volume's spacing), values are the data's own.");
    describe_volume(&mut page, file, volume);
    if let Some(medium) = &scene.medium {
        describe_medium(&mut page, medium);
    }
    describe_surfaces(&mut page, scene);
    describe_lights(&mut page, file, &scene.lights);
    describe_clips(&mut page, &scene.clips);
    describe_camera(&mut page, &scene.camera);
    describe_render(&mut page, &scene.render);
    page.text
}
