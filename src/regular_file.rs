//! Opening files that a user or another file names.

use std::fs::{File, Metadata};
use std::path::Path;

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
