//! Opens the argument of a command, a scene file or a bare volume, and collects everything that a renderer needs.

use std::path::{Path, PathBuf};

use super::Scene;
use super::file::{Edit, SceneFile, resolve};
use super::preset::Preset;
use super::volume::{Volume, VolumeOverrides};
use crate::error::{Error, Result};

/// Whether the argument is a scene file; anything else is a volume.
pub fn is_scene(path: &Path) -> bool {
    path.extension()
        .is_some_and(|e| e.eq_ignore_ascii_case("toml"))
}

/// A bare volume with what `edits` set of it; edits of anything else, and of its path, are refused.
pub fn bare_volume(volume: &Path, edits: &[Edit]) -> Result<SceneFile> {
    if let Some(edit) = edits.iter().find(|edit| !edit.is_about_volume()) {
        return Err(Error::Usage(format!(
            "{}: only keys of the volume can be set here, such as volume.channel",
            edit.flag()
        )));
    }
    check_path_stays(volume, edits)?;
    match edits {
        [] => Ok(SceneFile::default()),
        _ => SceneFile::bare(volume, edits),
    }
}

/// A volume that is named as the argument is the one that is shown.
fn check_path_stays(volume: &Path, edits: &[Edit]) -> Result<()> {
    let remedies = [
        (
            "volume.path",
            "name the other file in its place, or in a scene file",
        ),
        ("volume", "set its keys one by one, as in volume.channel=1"),
    ];
    for (key, remedy) in remedies {
        if let Some(edit) = edits.iter().find(|edit| edit.sets(key)) {
            return Err(Error::Usage(format!(
                "{}: the volume is {}; {remedy}",
                edit.flag(),
                volume.display()
            )));
        }
    }
    Ok(())
}

/// Everything that a renderer needs, from a scene file, or from a volume and a preset.
#[derive(Debug, Clone)]
pub struct Opened {
    pub file: SceneFile,
    pub volume: Volume,
    pub scene: Scene,
    /// Remarks for the user: one sentence each.
    pub notes: Vec<String>,
}

impl Opened {
    /// The files from which the scene is read, apart from a scene file itself.
    pub fn inputs(&self) -> Result<Vec<PathBuf>> {
        let mut inputs = vec![self.file.volume_path()?];
        inputs.extend(self.volume.files.iter().cloned());
        inputs.extend(self.file.images());
        Ok(inputs)
    }
}

/// Opens the argument of `render` and similar commands. A preset has no effect on a scene file, which a note says.
pub fn open(
    input: &Path,
    preset: Preset,
    edits: &[Edit],
    load: impl FnOnce(&Path, &VolumeOverrides) -> Result<Volume>,
) -> Result<Opened> {
    let (file, volume) = if is_scene(input) {
        let file = SceneFile::read(input, edits)?;
        file.check_images()?;
        let volume = load(&file.volume_path()?, &file.volume_overrides()?);
        let named_here = |error: Error| match &error {
            Error::Input { location, .. } if location.key.is_some() => file.at_its_key(error),
            _ if error.is_about_input() => file.origins.error("volume.path", error),
            _ => error,
        };
        let volume = volume.map_err(named_here)?;
        (file, volume)
    } else {
        check_path_stays(input, edits)?;
        let (about_volume, rest): (Vec<Edit>, Vec<Edit>) =
            edits.iter().cloned().partition(Edit::is_about_volume);
        let bare = SceneFile::bare(input, &about_volume)?;
        let volume = load(&bare.volume_path()?, &bare.volume_overrides()?)
            .map_err(|error| bare.at_its_key(error))?;
        let view = rest.iter().rev().find_map(Edit::named_view);
        let (name, mut scene) = preset.scene(input, &volume, view)?;
        scene.volume = bare.volume;
        (scene.edited(name, &rest)?, volume)
    };
    let (scene, notes) = resolve(&file, &volume)?;
    let mut notes = [volume.notes.clone(), notes].concat();
    if is_scene(input) && preset != Preset::Auto {
        notes.push(
            "--preset has no effect on a scene file, which says how the volume is shown".into(),
        );
    }
    Ok(Opened {
        file,
        volume,
        scene,
        notes,
    })
}
