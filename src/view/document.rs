//! An opened scene with the data that the window shows of its volume.

use std::path::PathBuf;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};

use crate::error::{Error, Result};
use crate::regular_file::Version;
use crate::scene::volume::Histogram;
use crate::scene::{Edit, Opened, is_scene};

pub struct Document {
    pub path: PathBuf,
    /// The version of the file at the path just before it was read.
    pub version: Option<Version>,
    /// The changes with which it was opened, beside the text at the path.
    pub edits: Vec<Edit>,
    pub opened: Opened,
    /// Of the range in which the data lie.
    pub histogram: Histogram,
    /// Shared with what copies the volume into its store.
    pub is_closed: Arc<AtomicBool>,
}

impl Document {
    /// The range of values in which the data lie, without outliers: that of plots and sliders, and what presets and steps
    /// of the wheel are shares of.
    pub fn range(&self) -> [f64; 2] {
        let [low, high] = self.opened.volume.range;
        // Bins of integers begin half a step below the smallest one.
        let bins = self.histogram.range();
        [low.max(bins[0]), high.min(bins[1])]
    }

    /// Asks the threads that work for this document to stop; they do so at their next check.
    pub fn close(&self) {
        self.is_closed.store(true, Ordering::Relaxed);
    }

    /// Whether this is a scene file that was edited after it had been opened as `before`.
    pub fn is_edit_of(&self, before: &Document) -> bool {
        is_scene(&self.path) && self.path == before.path && self.edits == before.edits
    }

    /// Fails with [`Error::Interrupted`] once the document was closed.
    pub fn check_wanted(&self) -> Result<()> {
        if self.is_closed.load(Ordering::Relaxed) {
            Err(Error::Interrupted)
        } else {
            Ok(())
        }
    }
}
