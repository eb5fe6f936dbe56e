//! Files that a user or another file names: opening them, and noticing that they have changed.

use std::fs::{File, Metadata};
use std::path::Path;
use std::time::SystemTime;

pub const HAS_CHANGED: &str = "the file has changed since it was opened; open it again";

/// Opens a file, and returns its metadata with it. Anything but a regular file is refused: a header may name a pipe or
/// a device, and reading that could wait for ever.
pub fn open_file(path: &Path) -> Result<(File, Metadata), String> {
    let metadata = std::fs::metadata(path).map_err(|e| e.to_string())?;
    if !metadata.is_file() {
        return Err("is not a regular file".into());
    }
    let file = File::open(path).map_err(|e| e.to_string())?;
    Ok((file, metadata))
}

/// By what a change of a file is noticed.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Version {
    pub bytes: u64,
    /// `None` where the system keeps no times.
    pub modified: Option<SystemTime>,
}

impl Version {
    pub fn of(metadata: &Metadata) -> Version {
        Version {
            bytes: metadata.len(),
            modified: metadata.modified().ok(),
        }
    }

    /// The version of the file with this name; `None` if there is none, or if it is a folder or a pipe.
    pub fn at(path: &Path) -> Option<Version> {
        let metadata = std::fs::metadata(path).ok().filter(Metadata::is_file)?;
        Some(Version::of(&metadata))
    }

    /// Fails if an open file has another version by now.
    pub fn check(self, file: &File) -> Result<(), String> {
        let metadata = file.metadata().map_err(|e| e.to_string())?;
        if Version::of(&metadata) == self {
            Ok(())
        } else {
            Err(HAS_CHANGED.into())
        }
    }
}
