//! The scene file: the user's text with types, and every default still open.
//!
//! There is a file for each table: its keys, their meaning, and how they are printed. Three steps lead from text to a
//! [`Scene`](super::Scene). A `Document` is the TOML with the command line's changes, where each key knows its line
//! or flag; a [`SceneFile`] is that with types; [`resolve`] fills in what depends on the volume. All checks that need
//! no volume run before it is read, so that a typo in a scene of many gigabytes is reported at once.

mod camera;
mod clips;
mod description;
mod document;
mod edit;
mod lights;
mod medium;
mod mismatch;
mod numbers;
mod origins;
mod page;
mod render;
mod resolve;
mod series;
mod surfaces;
mod visible;
mod volume;

use std::path::Path;

use serde::{Deserialize, Serialize};

use crate::error::{Error, Location, Result};
pub use camera::CameraTable;
pub use clips::ClipTable;
pub use description::describe;
use document::Document;
pub use edit::Edit;
pub use lights::{LightKind, LightTable};
pub use medium::{MediumTable, TransferTable};
pub use origins::Origins;
pub use render::{EXPOSURE, RenderTable};
pub use resolve::resolve;
pub use surfaces::{IsoTable, ShadingModel, SurfacesTable};
pub use volume::VolumeTable;

/// The whole file. Its keys are the contract's; `None` means that the user has not set the key.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct SceneFile {
    pub volume: VolumeTable,
    pub medium: Option<MediumTable>,
    pub surfaces: SurfacesTable,
    pub light: Vec<LightTable>,
    pub clip: Vec<ClipTable>,
    pub camera: CameraTable,
    pub render: RenderTable,
    /// Where each key was written, for messages.
    #[serde(skip)]
    pub origins: Origins,
}

impl SceneFile {
    pub fn read(path: &Path, edits: &[Edit]) -> Result<SceneFile> {
        let mut document = Document::read(path)?;
        document.apply(edits)?;
        document.typed()
    }

    /// `path` gives messages their file name, and relative paths their folder.
    pub fn parse(text: &str, path: &Path, edits: &[Edit]) -> Result<SceneFile> {
        let mut document = Document::parse(text, path)?;
        document.apply(edits)?;
        document.typed()
    }

    /// The same scene with the command line's changes; `name` stands for a file in messages.
    pub fn edited(&self, name: String, edits: &[Edit]) -> Result<SceneFile> {
        let mut document = Document::made(self, name);
        document.apply(edits)?;
        document.typed()
    }

    /// A scene with only a volume: everything else is filled in by a preset.
    pub(super) fn bare(volume: &Path, edits: &[Edit]) -> Result<SceneFile> {
        let name = volume.display().to_string();
        if volume.to_str().is_none() {
            return Err(Error::input(
                Location::file(name),
                "the path is not UTF-8: rename it",
            ));
        }
        let mut file = SceneFile::default();
        file.volume.path = Some(volume.to_path_buf());
        file.edited(name, edits)
    }
}
