//! Files under temporary names, which become outputs or stores by a rename once they are whole.
//!
//! Whoever drops one removes it. A process that ends without dropping anything calls [`remove_all`] first.

use std::fs;
use std::io;
use std::path::{Path, PathBuf};
use std::sync::{Mutex, PoisonError};

use tempfile::NamedTempFile;

/// Files under temporary names that may be there now.
static NAMES: Mutex<Vec<PathBuf>> = Mutex::new(Vec::new());

/// Removes all files that are still under temporary names. Nobody writes any more from then on: the process has to end.
#[cfg(feature = "cli")]
pub fn remove_all() {
    let names = NAMES.lock().unwrap_or_else(PoisonError::into_inner);
    for name in names.iter() {
        // It may have its final name already.
        let _ = fs::remove_file(name);
    }
    std::mem::forget(names);
}

/// A temporary name on the list of those, until it is dropped.
pub struct Listed(PathBuf);

impl Drop for Listed {
    fn drop(&mut self) {
        let mut names = NAMES.lock().unwrap_or_else(PoisonError::into_inner);
        names.retain(|name| *name != self.0);
    }
}

/// Makes a file with a new name that begins with `prefix`. The second value has to be dropped after the first.
pub fn create(folder: &Path, prefix: &str) -> io::Result<(NamedTempFile, Listed)> {
    let mut builder = tempfile::Builder::new();
    builder.prefix(prefix);
    // Temporary files are private by default; these have the permissions of any new file.
    #[cfg(unix)]
    {
        use std::os::unix::fs::PermissionsExt;
        builder.permissions(fs::Permissions::from_mode(0o666));
    }
    // Whoever removes all files on the list must not miss this one.
    let mut names = NAMES.lock().unwrap_or_else(PoisonError::into_inner);
    let file = builder.tempfile_in(folder)?;
    let path = file.path().to_owned();
    names.push(path.clone());
    Ok((file, Listed(path)))
}
