//! The folder that a report goes into.

use std::fs;
use std::path::{Path, PathBuf};

use crate::error::{Error, Location, Result};

/// A folder that is made if it is missing, and removed again if it is still empty when this is dropped.
pub struct Folder {
    path: PathBuf,
    is_new: bool,
}

impl Folder {
    pub fn make(path: &Path) -> Result<Folder> {
        if path.exists() && !path.is_dir() {
            let flag = Location::flag(format!("-o {}", path.display()));
            return Err(Error::input(
                flag,
                "it is a file; name a folder for the report",
            ));
        }
        let folder = Folder {
            path: path.to_owned(),
            is_new: !path.exists(),
        };
        fs::create_dir_all(path).map_err(|error| Error::io(path, error))?;
        Ok(folder)
    }

    pub fn file(&self, name: &str) -> PathBuf {
        self.path.join(name)
    }
}

impl Drop for Folder {
    fn drop(&mut self) {
        if self.is_new {
            // This fails where a report is in the folder, as it should.
            let _ = fs::remove_dir(&self.path);
        }
    }
}
