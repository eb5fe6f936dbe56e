//! A file of which parts are read again and again, and which must not change after it was opened: what has been found
//! out about its voxels holds for no other state.

use std::fs::File;
use std::io;
use std::path::{Path, PathBuf};

use crate::regular_file::{HAS_CHANGED, Version, open_file};
use crate::scene::volume::parsed::Parsed;

/// A file that is read by several threads at once.
#[derive(Debug)]
pub struct WatchedFile {
    path: PathBuf,
    version: Version,
    /// `None` for one of many files, which is opened whenever it is read: a process may not hold thousands open.
    file: Option<File>,
}

impl WatchedFile {
    pub fn open(path: &Path) -> Parsed<WatchedFile> {
        let (file, metadata) = open_file(path)?;
        Ok(WatchedFile {
            path: path.to_path_buf(),
            version: Version::of(&metadata),
            file: Some(file),
        })
    }

    /// The same file, which from now on is only open while it is read.
    pub fn closed(self) -> WatchedFile {
        WatchedFile { file: None, ..self }
    }

    pub fn path(&self) -> &Path {
        &self.path
    }

    pub fn version(&self) -> Version {
        self.version
    }

    pub fn bytes(&self) -> u64 {
        self.version.bytes
    }

    /// The `count` bytes from `offset` on. They must all be in the file; that is checked before memory is allocated
    /// for them.
    pub fn read(&self, offset: u64, count: u64) -> Parsed<Vec<u8>> {
        let end = offset.checked_add(count);
        if end.is_none_or(|end| end > self.bytes()) {
            return Err(format!(
                "{count} bytes from byte {offset} on are expected, but the file ends after {}: it is \
                 truncated, or damaged",
                self.bytes()
            ));
        }
        let mut bytes = vec![0; count as usize];
        match &self.file {
            Some(file) => self.fill(file, offset, &mut bytes)?,
            None => self.fill(&open_file(&self.path)?.0, offset, &mut bytes)?,
        }
        Ok(bytes)
    }

    fn fill(&self, file: &File, offset: u64, bytes: &mut [u8]) -> Parsed<()> {
        let mut filled = 0;
        while filled < bytes.len() {
            match read_at(file, &mut bytes[filled..], offset + filled as u64) {
                Ok(0) => return Err(HAS_CHANGED.into()),
                Ok(count) => filled += count,
                Err(e) if e.kind() == io::ErrorKind::Interrupted => {}
                Err(e) => return Err(e.to_string()),
            }
        }
        self.version.check(file)
    }
}

/// Reads at a position of the file, independently of other readers.
pub fn read_at(file: &File, bytes: &mut [u8], offset: u64) -> io::Result<usize> {
    #[cfg(unix)]
    return std::os::unix::fs::FileExt::read_at(file, bytes, offset);
    #[cfg(windows)]
    return std::os::windows::fs::FileExt::seek_read(file, bytes, offset);
}
