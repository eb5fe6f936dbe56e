//! An opened scene with what the window shows of its volume.

use std::path::PathBuf;

use crate::scene::volume::Histogram;
use crate::scene::{Edit, Opened};

pub struct Document {
    pub path: PathBuf,
    /// What it was opened with, on top of what is written at the path.
    pub edits: Vec<Edit>,
    pub opened: Opened,
    pub histogram: Histogram,
}
