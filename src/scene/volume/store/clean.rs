//! Removes stores.

use std::fs;
use std::io;
use std::path::Path;

use super::{PREFIX, SUFFIX};
use crate::error::{Error, Result};
use crate::temporary;

/// Files that were removed.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub struct Removed {
    pub files: u64,
    pub bytes: u64,
}

/// Removes all stores of a folder, and temporary files of stores that killed processes have left. No other file is
/// touched.
///
/// # Errors
///
/// If the folder or a file in it cannot be examined or removed; a folder that does not exist counts as empty.
pub fn clean(folder: &Path) -> Result<Removed> {
    let mut removed = Removed::default();
    let entries = match fs::read_dir(folder) {
        Ok(entries) => entries,
        Err(e) if e.kind() == io::ErrorKind::NotFound => return Ok(removed),
        Err(e) => return Err(Error::io(folder, e)),
    };
    for entry in entries {
        let entry = entry.map_err(|e| Error::io(folder, e))?;
        let (name, path) = (entry.file_name(), entry.path());
        let name = name.to_string_lossy();
        let lock = name
            .starts_with(PREFIX)
            .then(|| temporary::abandoned(&path))
            .flatten();
        let is_ours = is_store(&name) || lock.is_some();
        let Some(metadata) = entry.metadata().ok().filter(|m| is_ours && m.is_file()) else {
            continue;
        };
        fs::remove_file(&path).map_err(|e| Error::io(&path, e))?;
        removed.files += 1;
        removed.bytes += metadata.len();
    }
    Ok(removed)
}

fn is_store(name: &str) -> bool {
    let hash = name.strip_suffix(SUFFIX);
    hash.is_some_and(|hash| hash.len() == 16 && hash.bytes().all(|b| b.is_ascii_hexdigit()))
}
