//! A lock, so that one process at a time works with a checkpoint.
//!
//! The lock is a file of its own beside the checkpoint, since writing replaces the checkpoint. The system releases it
//! when the process ends, however that ends.

use std::fs::{self, File, TryLockError};
use std::io::{self, ErrorKind};
use std::path::{Path, PathBuf};

use super::beside;
use crate::error::{Error, Result};
use crate::temporary::Listed;

/// Held until it is dropped.
pub struct Lock {
    path: PathBuf,
    _file: File,
    // Declared last, so that it is dropped after the file: the name stays on the list until the file is removed.
    _listed: Listed,
}

impl Lock {
    /// Fails if another process holds it.
    pub fn take(checkpoint: &Path) -> Result<Lock> {
        let path = beside(checkpoint, "lock");
        loop {
            let io = |error| Error::io(&path, error);
            let mut open = File::options();
            let file = open.create(true).write(true).truncate(false).open(&path);
            let file = file.map_err(io)?;
            if file.metadata().map_err(io)?.len() > 0 {
                return Err(Error::input(
                    path.as_path(),
                    "it is not empty, so it is no lock of a checkpoint; move it, or name another checkpoint",
                ));
            }
            match file.try_lock() {
                Ok(()) => {}
                // Not every file system has locks: there the user has to ensure that processes do not collide.
                Err(TryLockError::Error(error)) if is_without_locks(&error) => {}
                Err(TryLockError::WouldBlock) => {
                    return Err(Error::input(
                        checkpoint,
                        "another process uses this checkpoint; wait for it or name another file",
                    ));
                }
                Err(TryLockError::Error(error)) => return Err(Error::io(&path, error)),
            }
            // Its last holder may have removed the file in between.
            if is_at(&file, &path) {
                return Ok(Lock {
                    _listed: Listed::new(path.clone()),
                    path,
                    _file: file,
                });
            }
        }
    }
}

impl Drop for Lock {
    fn drop(&mut self) {
        // A leftover file does not lock anything.
        let _ = fs::remove_file(&self.path);
    }
}

/// Whether an error says that the file system has no locks. NFS whose server or client has no lock daemon has a number of its
/// own for it.
fn is_without_locks(error: &io::Error) -> bool {
    #[cfg(unix)]
    if error.raw_os_error() == Some(libc::ENOLCK) {
        return true;
    }
    error.kind() == ErrorKind::Unsupported
}

/// Whether a name still leads to a file.
#[cfg(unix)]
fn is_at(file: &File, path: &Path) -> bool {
    use std::os::unix::fs::MetadataExt;
    let number = |metadata: fs::Metadata| (metadata.dev(), metadata.ino());
    let held = file.metadata().map(number).ok();
    held.is_some() && held == fs::metadata(path).map(number).ok()
}

/// On other systems, an open file cannot be replaced.
#[cfg(not(unix))]
fn is_at(_: &File, _: &Path) -> bool {
    true
}
