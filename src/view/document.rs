//! An opened scene with what the window shows of its volume.

use std::path::PathBuf;

use crate::scene::Opened;
use crate::scene::volume::Histogram;

pub struct Document {
    pub path: PathBuf,
    pub opened: Opened,
    pub histogram: Histogram,
}
