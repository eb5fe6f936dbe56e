//! Watches the scene file: an edit on disk shows at once.

use std::path::{Path, PathBuf};
use std::time::{Duration, Instant, SystemTime};

/// The time between two looks at the file.
pub const INTERVAL: Duration = Duration::from_millis(250);

pub struct Watch {
    pub path: PathBuf,
    seen: Option<SystemTime>,
    looked: Instant,
}

impl Watch {
    pub fn new(path: &Path) -> Watch {
        Watch {
            path: path.to_path_buf(),
            seen: modified(path),
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

fn modified(path: &Path) -> Option<SystemTime> {
    path.metadata().and_then(|m| m.modified()).ok()
}
