//! The outputs of a render: the picture, its statistics, a trace of where the time went, and progress on the way
//! there.
//!
//! Every file goes through [`Outputs`], so that a name that a user sees always holds a whole file.

mod atomic;
pub mod channels;
pub mod display;
mod exr;
mod png;
#[cfg(feature = "cli")]
pub mod progress;
pub mod stats;
pub mod time_table;
pub mod trace;

use std::io::Write;
use std::path::Path;

use serde::Serialize;

use crate::engine::Picture;
use crate::error::{Error, Result};
use crate::render::Sums;
use crate::scene::Tone;

pub use self::exr::{HEADER_ATTRIBUTE, SCENE_ATTRIBUTE, seed_of};
pub use atomic::{
    Outputs, check_inputs_stay, check_writable, has_committed, target_of, wait_no_longer,
};

/// A result as JSON that people can read.
pub fn to_json(value: &impl Serialize) -> Result<String> {
    serde_json::to_string_pretty(value).map_err(|e| Error::value(format!("JSON: {e}")))
}

/// Prints a line to stderr, or several, [`escaped`]. A closed stderr is not an error.
pub fn say(line: impl std::fmt::Display) {
    let _ = writeln!(std::io::stderr(), "{}", escaped(&line.to_string()));
}

/// A text without the control characters that names of files may have, so that they do not reach a terminal.
fn escaped(text: &str) -> String {
    let escaped = |c: char| {
        if c.is_control() && c != '\n' {
            c.escape_default().to_string()
        } else {
            c.to_string()
        }
    };
    text.chars().map(escaped).collect()
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

/// The name of a scene's or a volume's pictures. Of a file, it is its name without the extension (`head` for `head.nii.gz`); of
/// a folder its whole name, since a dot there begins no extension, but for `.zarr`.
pub fn stem(input: &Path) -> String {
    let whole = input.canonicalize().unwrap_or_else(|_| input.to_owned());
    let Some(name) = input.file_name().or(whole.file_name()) else {
        return "isolume".into();
    };
    let name = name.to_string_lossy();
    if input.is_dir() {
        return name.strip_suffix(".zarr").unwrap_or(&name).to_owned();
    }
    let name = name.strip_suffix(".gz").unwrap_or(&name);
    let stem = Path::new(name).file_stem();
    stem.map_or(name.to_owned(), |stem| stem.to_string_lossy().into_owned())
}

/// The origin of a picture, for its header.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Provenance {
    /// The resolved scene.
    pub scene: String,
    pub seed: u32,
    pub device: String,
    /// The program's name and version.
    pub software: String,
}

impl Provenance {
    /// The origin of a picture of this program's.
    pub fn new(scene: String, seed: u32, device: String) -> Provenance {
        Provenance {
            scene,
            seed,
            device,
            software: concat!("isolume ", env!("CARGO_PKG_VERSION")).into(),
        }
    }
}

/// Additional contents of an EXR with which another run can continue the picture.
#[derive(Debug, Clone)]
pub struct Continuation<'a> {
    /// As JSON.
    header: String,
    sums: &'a Sums,
    /// Whether the file is written fast and large.
    is_quick: bool,
}

impl<'a> Continuation<'a> {
    pub fn of(header: &impl Serialize, sums: &'a Sums) -> Result<Continuation<'a>> {
        Ok(Continuation {
            header: serde_json::to_string(header)
                .map_err(|error| Error::value(format!("a header: {error}")))?,
            sums,
            is_quick: false,
        })
    }

    /// In a file that is written fast and large.
    pub fn quick(self) -> Continuation<'a> {
        Continuation {
            is_quick: true,
            ..self
        }
    }
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

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn pictures_are_named_after_what_they_show() {
        for (input, name) in [
            ("scans/head.nii.gz", "head"),
            ("head.toml", "head"),
            ("head", "head"),
        ] {
            assert_eq!(stem(Path::new(input)), name);
        }
        let folder = tempfile::tempdir().expect("a folder");
        for (inner, name) in [("1.2.840.5", "1.2.840.5"), ("brain.ome.zarr", "brain.ome")] {
            let input = folder.path().join(inner);
            std::fs::create_dir(&input).expect("a folder in it");
            assert_eq!(stem(&input), name);
            assert_eq!(stem(&input.join(".")), name);
        }
    }
}
