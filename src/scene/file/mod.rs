//! The scene file: what the user wrote, typed, with every default still open.
//!
//! Three steps lead from text to a [`Scene`](super::Scene). A `Document` is the TOML with the command line's
//! changes, where each key knows its line or flag; a [`SceneFile`] is that with types; [`resolve`]
//! fills in what depends on the volume. All checks that need no volume run before it is read, so
//! that a typo in a scene of many gigabytes is told at once.

mod document;
mod lights;
mod mismatch;
mod resolve;
mod series;
mod settings;
mod visible;

use std::path::{Path, PathBuf};

use serde::{Deserialize, Serialize};

use document::Document;
pub use document::{Edit, Origins};
pub use resolve::resolve;

use super::{Background, CacheFormat, CacheScale, LightModel, Normals, Tone, Variant, View};
use crate::error::{Error, Place, Result};
use crate::scene::volume::Pick;

/// The whole file. Its keys are the contract's; `None` means that the user left it to us.
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

#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct VolumeTable {
    /// The path as it is written, relative to the scene file. [`SceneFile::volume_path`] is the one to open.
    pub path: Option<PathBuf>,
    pub dims: Option<[u32; 3]>,
    #[serde(rename = "type")]
    pub voxel_type: Option<String>,
    pub endian: Option<Endianness>,
    pub channel: Option<u32>,
    pub time: Option<u32>,
    pub level: Option<u32>,
    pub spacing: Option<[f64; 3]>,
    pub axes: Option<String>,
    pub crop: Option<[[u32; 3]; 2]>,
    pub series: Option<Pick>,
    pub fill_gaps: Option<bool>,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Endianness {
    Little,
    Big,
}

#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct MediumTable {
    pub density: Option<f64>,
    pub g: Option<f64>,
    pub transfer: Vec<TransferTable>,
}

#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct TransferTable {
    pub value: f64,
    pub opacity: Option<f64>,
    pub color: Option<[f64; 3]>,
}

#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct SurfacesTable {
    pub light: Option<LightModel>,
    pub normals: Option<Normals>,
    pub iso: Vec<IsoTable>,
}

#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum ShadingModel {
    #[default]
    Lambert,
    Phong,
    Disney,
}

#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct IsoTable {
    pub value: f64,
    pub opacity: Option<f64>,
    pub shading: Option<ShadingModel>,
    pub color: Option<[f64; 3]>,
    pub specular: Option<f64>,
    pub shininess: Option<f64>,
    pub roughness: Option<f64>,
    pub metallic: Option<f64>,
    pub specular_tint: Option<f64>,
    pub sheen: Option<f64>,
    pub sheen_tint: Option<f64>,
    pub subsurface: Option<f64>,
    pub clearcoat: Option<f64>,
    pub clearcoat_gloss: Option<f64>,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum LightKind {
    Directional,
    Environment,
}

#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct LightTable {
    #[serde(rename = "type")]
    pub kind: LightKind,
    pub direction: Option<[f64; 3]>,
    pub irradiance: Option<[f64; 3]>,
    pub radiance: Option<[f64; 3]>,
    pub image: Option<PathBuf>,
}

#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct ClipTable {
    pub normal: [f64; 3],
    pub offset: Option<f64>,
}

#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct CameraTable {
    pub eye: Option<[f64; 3]>,
    pub view: Option<View>,
    pub target: Option<[f64; 3]>,
    pub up: Option<[f64; 3]>,
    pub fov_y: Option<f64>,
    pub orthographic: Option<f64>,
}

#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct RenderTable {
    pub size: Option<[u32; 2]>,
    pub max_bounces: Option<u32>,
    pub variant: Option<Variant>,
    pub cache_scale: Option<CacheScale>,
    pub cache_format: Option<CacheFormat>,
    pub background: Option<Background>,
    pub exposure: Option<f64>,
    pub tone: Option<Tone>,
}

impl SceneFile {
    pub fn read(path: &Path, edits: &[Edit]) -> Result<SceneFile> {
        let mut document = Document::read(path)?;
        document.apply(edits)?;
        document.typed()
    }

    /// `path` gives the messages their file name and relative paths their folder.
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

    /// A bare volume: everything else is left to a preset.
    pub(super) fn bare(volume: &Path, edits: &[Edit]) -> Result<SceneFile> {
        let name = volume.display().to_string();
        if volume.to_str().is_none() {
            return Err(Error::input(
                Place::file(name),
                "the path is not UTF-8: rename it",
            ));
        }
        let mut file = SceneFile::default();
        file.volume.path = Some(volume.to_path_buf());
        file.edited(name, edits)
    }
}
