//! Resolves a scene file into a scene: fills in every default and checks every value.
//!
//! The file of each table has one method that builds its part of the scene and is its only check.
//! [`SceneFile::check`] calls those that need no volume and drops what they build.

use super::SceneFile;
use crate::error::Result;
use crate::scene::volume::Volume;
use crate::scene::{Medium, Scene};

/// The scene, and remarks for the user: one sentence each.
pub fn resolve(file: &SceneFile, volume: &Volume) -> Result<(Scene, Vec<String>)> {
    let extent = volume.extent();
    let mut notes = Vec::new();
    let render = file.render_settings()?;
    let aspect = f64::from(render.size[0]) / f64::from(render.size[1]);
    let scene = Scene {
        medium: file.medium(Medium::default_density(extent))?,
        surfaces: file.surfaces()?,
        lights: file.lights(&mut notes)?,
        clips: file.clips()?,
        camera: file.camera(extent, volume.axes, aspect)?,
        render,
    };
    file.note_idle_parameters(&mut notes);
    file.note_idle_cache_keys(&mut notes);
    file.check_visible(&scene, volume.range, &mut notes)?;
    Ok((scene, notes))
}

impl SceneFile {
    /// Finds all errors that do not depend on the volume.
    pub(super) fn check(&self) -> Result<()> {
        self.volume_overrides()?;
        self.medium(1.0)?;
        self.surfaces()?;
        self.lights_without_images()?;
        self.clips()?;
        self.check_camera()?;
        self.render_settings()?;
        Ok(())
    }
}
