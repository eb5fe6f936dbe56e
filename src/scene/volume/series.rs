//! The volumes of a folder that holds several.

use serde::Serialize;

use super::thumbnail::Thumbnail;

/// One volume of a folder, described by its headers. Field names are a contract with scripts.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Series {
    /// Its number, from 1 on, the largest volume first: the scene's `volume.series`.
    pub number: u32,
    pub uid: String,
    pub description: String,
    /// "CT", "MR" and so on.
    pub modality: String,
    /// Slices in the files, duplicates left out.
    pub slices: u32,
    /// Voxels along each axis once it is loaded.
    pub dims: [u32; 3],
    /// Millimetres.
    pub spacing: [f64; 3],
    /// What is done to load it, or why it cannot be loaded: one sentence each.
    pub notes: Vec<String>,
}

/// One volume of a folder, for a list in a window.
#[derive(Debug, Clone, PartialEq)]
pub struct Preview {
    pub series: Series,
    /// A picture of the middle slice; `None` where that cannot be decoded.
    pub thumbnail: Option<Thumbnail>,
}
