//! Watches the scene file: an edit on disk shows at once.

use std::path::{Path, PathBuf};
use std::time::{Duration, Instant};

use crate::regular_file::Version;
use crate::scene::Edit;

/// The time between two looks at the file.
pub const INTERVAL: Duration = Duration::from_millis(250);

pub struct Watch {
    pub path: PathBuf,
    /// The changes of the command line, and a series that was picked, with which the file was opened.
    pub edits: Vec<Edit>,
    seen: Option<Version>,
    looked: Instant,
}

impl Watch {
    /// `read`: the version of the file whose text is shown.
    pub fn new(path: &Path, edits: &[Edit], read: Option<Version>) -> Watch {
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
        let now = Version::at(&self.path);
        let changed = now.is_some() && now != self.seen;
        if changed {
            self.seen = now;
        }
        changed
    }
}
