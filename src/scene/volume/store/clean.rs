//! Removes stores.

use std::fs::{self, File, TryLockError};
use std::io;
use std::path::Path;

use super::{PREFIX, SUFFIX};
use crate::error::{Error, Result};

/// Files that were removed.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub struct Removed {
    pub files: u64,
    pub bytes: u64,
}

/// Removes all stores of a folder, and what killed processes have left of some. No other file is touched.
///
/// # Errors
///
/// The folder or a file in it cannot be looked at or removed; a folder that does not exist is empty.
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
        let is_ours = is_store(&name) || name.starts_with(PREFIX) && is_abandoned(&path);
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

/// Removes what killed processes have left under names that begin with `prefix`.
pub(super) fn remove_abandoned(folder: &Path, prefix: &str) {
    for entry in fs::read_dir(folder).into_iter().flatten().flatten() {
        let is_named = entry.file_name().to_string_lossy().starts_with(prefix);
        if is_named && is_abandoned(&entry.path()) {
            // If it stays, it stays for `isolume clean`.
            let _ = fs::remove_file(entry.path());
        }
    }
}

/// Whether nobody holds the lock of a temporary file.
fn is_abandoned(path: &Path) -> bool {
    // A lock that could be taken is given back with the file.
    File::open(path).is_ok_and(|file| match file.try_lock() {
        Ok(()) => true,
        Err(TryLockError::WouldBlock | TryLockError::Error(_)) => false,
    })
}
