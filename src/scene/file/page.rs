//! Prints a resolved scene as a scene file: every key, with its unit in a comment. Reading it again gives the same
//! scene to the last bit, so it is also stored in an EXR's header.

use serde::Serialize;
use toml::Value;

use super::SceneFile;
use super::camera::describe_camera;
use super::clips::describe_clips;
use super::lights::describe_lights;
use super::medium::describe_medium;
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

/// TOML under construction.
#[derive(Default)]
pub(super) struct Page {
    pub text: String,
}

impl Page {
    pub fn table(&mut self, header: &str) {
        self.text += &format!("\n{header}\n");
    }

    pub fn comment(&mut self, comment: &str) {
        self.text += &format!("# {comment}\n");
    }

    pub fn line(&mut self, key: &str, value: impl Serialize, comment: &str) {
        let value = Value::try_from(value).expect("scene values are representable as TOML");
        let line = format!("{key} = {value}");
        match comment {
            "" => self.text += &format!("{line}\n"),
            _ => self.text += &format!("{line:<40} # {comment}\n"),
        }
    }

    /// Writes a key that the user has set, or else a comment with the value from the volume's own file.
    pub fn line_or_comment<T: Serialize>(
        &mut self,
        key: &str,
        given: Option<T>,
        known: T,
        why: &str,
    ) {
        match given {
            Some(value) => self.line(key, value, why),
            None => {
                self.text += "# ";
                self.line(key, known, why);
            }
        }
    }
}
