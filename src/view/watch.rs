//! Watches the scene file: an edit on disk shows at once.

use std::path::{Path, PathBuf};
use std::time::{Duration, Instant, SystemTime};

use crate::scene::Edit;

/// The time between two looks at the file.
pub const INTERVAL: Duration = Duration::from_millis(250);

pub struct Watch {
    pub path: PathBuf,
    /// The changes of the command line, and a series that was picked, with which the file was opened.
    pub edits: Vec<Edit>,
    seen: Option<SystemTime>,
    looked: Instant,
}

impl Watch {
    /// `read`: when the text that is shown was last modified.
    pub fn new(path: &Path, edits: &[Edit], read: Option<SystemTime>) -> Watch {
        Watch {
            path: path.to_path_buf(),
            edits: edits.to_vec(),
            seen: read,
            looked: Instant::now(),
        }
    }

    /// Whether the file has changed since the last call. A file that is gone for a moment, as while some editors
    /// save, has not.
    pub fn has_changed(&mut self) -> bool {
        if self.looked.elapsed() < INTERVAL {
            return false;
        }
        self.looked = Instant::now();
        let now = modified(&self.path);
        let changed = now.is_some() && now != self.seen;
        if changed {
            self.seen = now;
        }
        changed
    }
}

/// When a file was last modified; `None` for anything else, since reading a pipe would wait for its writer.
pub fn modified(path: &Path) -> Option<SystemTime> {
    let metadata = path.metadata().ok()?;
    metadata.is_file().then(|| metadata.modified().ok())?
}
