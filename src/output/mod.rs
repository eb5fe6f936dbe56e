//! What a render leaves behind: the picture, its statistics, a trace of where the time went, and
//! progress on the way there. Nothing here knows how the picture came about.
//!
//! Every file goes through [`Outputs`], so that a name a user sees always holds a whole file.

mod atomic;
pub mod display;
mod exr;
mod png;
pub mod profile;
pub mod progress;
pub mod stats;
pub mod trace;

use std::path::Path;

use crate::error::{Error, Result};
use crate::scene::Tone;

pub use atomic::{Outputs, check_writable};

/// A finished picture and its layers, row 0 on top; every vector holds width × height pixels.
#[derive(Debug, Clone, PartialEq)]
pub struct Picture {
    pub width: u32,
    pub height: u32,
    /// Linear radiance, premultiplied where there is an alpha.
    pub rgb: Vec<[f32; 3]>,
    /// Coverage; only where the background is transparent.
    pub alpha: Option<Vec<f32>>,
    /// Standard error of each pixel's mean.
    pub stderr: Vec<[f32; 3]>,
    pub albedo: Vec<[f32; 3]>,
    pub normal: Vec<[f32; 3]>,
    /// Along the pixel centre's ray to the first surface; +inf where there is none.
    pub depth: Vec<f32>,
}

impl Picture {
    pub fn relative_error(&self) -> f64 {
        relative_error(&self.rgb, &self.stderr)
    }
}

/// rms(stderr) / mean(RGB): what `--error` is about and the statistics report.
pub fn relative_error(rgb: &[[f32; 3]], stderr: &[[f32; 3]]) -> f64 {
    let values = |layer: &[[f32; 3]], term: fn(f64) -> f64| {
        let sum: f64 = layer.as_flattened().iter().map(|&v| term(v.into())).sum();
        sum / (layer.len() * 3) as f64
    };
    let rms = values(stderr, |v| v * v).sqrt();
    // A black picture without noise is exact, not undefined.
    if rms == 0.0 {
        0.0
    } else {
        rms / values(rgb, |v| v)
    }
}

/// The picture formats that can be written, told apart by the file name's extension.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Format {
    Exr,
    Png,
}

impl Format {
    pub fn of(path: &Path) -> Result<Format> {
        let extension = path.extension().map(|e| e.to_string_lossy().to_lowercase());
        match extension.as_deref() {
            Some("exr") => Ok(Format::Exr),
            Some("png") => Ok(Format::Png),
            found => Err(Error::Usage(format!(
                "-o {}: the name ends in {}; a picture is written as .exr or .png",
                path.display(),
                found.map_or("no extension".to_owned(), |e| format!(".{e}")),
            ))),
        }
    }
}

/// Where a picture comes from, for its header.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Provenance {
    /// The resolved scene.
    pub scene: String,
    pub seed: u32,
    pub device: String,
    /// Name and version.
    pub software: String,
}

/// Writes one EXR with all layers.
pub fn write_exr(path: &Path, picture: &Picture, provenance: &Provenance) -> Result<()> {
    let mut outputs = Outputs::default();
    outputs.exr(path, picture, provenance)?;
    outputs.commit()
}

/// Writes one 8-bit PNG, exposed by `exposure` stops.
pub fn write_png(path: &Path, picture: &Picture, exposure: f64, tone: Tone) -> Result<()> {
    let mut outputs = Outputs::default();
    outputs.png(path, picture, exposure, tone)?;
    outputs.commit()
}
