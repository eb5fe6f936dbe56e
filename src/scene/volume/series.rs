//! The volumes of a folder that holds several.

use serde::Serialize;

use super::thumbnail::Thumbnail;

/// One of them, as its headers describe it. Field names are a contract with scripts.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Series {
    /// From 1 on, the largest first: the scene's `volume.series`.
    pub number: u32,
    pub uid: String,
    pub description: String,
    /// "CT", "MR" and so on.
    pub modality: String,
    /// Slices in the files, doubles left out.
    pub slices: u32,
    /// As they would be loaded.
    pub dims: [u32; 3],
    pub spacing: [f64; 3],
    /// What is done to load it, or why it cannot be: one sentence each.
    pub notes: Vec<String>,
}

/// One of them as a list in a window shows it.
#[derive(Debug, Clone, PartialEq)]
pub struct Preview {
    pub series: Series,
    /// Of the middle slice; `None` where that cannot be decoded.
    pub thumbnail: Option<Thumbnail>,
}
