//! An opened scene with the data that the window shows of its volume.

use std::path::PathBuf;

use crate::scene::volume::Histogram;
use crate::scene::{Edit, Opened};

pub struct Document {
    pub path: PathBuf,
    /// The changes with which it was opened, beside the text at the path.
    pub edits: Vec<Edit>,
    pub opened: Opened,
    pub histogram: Histogram,
}
