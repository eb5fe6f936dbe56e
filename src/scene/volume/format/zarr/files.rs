//! The files in an array's folder, and which of them are chunks.

use std::path::{Path, PathBuf};

use super::array::Array;

/// Links to folders that are followed: they may lead round in circles.
const MOST_LINKS: usize = 1 << 16;

impl Array {
    /// All files in the array's folder, and in those in it where chunks lie in folders: one for each axis, and one for the
    /// prefix. A file or a folder of a key may be a link.
    pub fn files(&self) -> impl Iterator<Item = PathBuf> + use<> {
        let full = match self.keys.separator {
            '/' => self.shape.len() + 1,
            _ => 1,
        };
        let prefix = self.keys.prefix;
        let mut links_left = MOST_LINKS;
        let mut may_follow = move |path: &Path| {
            let name = path.file_name().unwrap_or_default().to_string_lossy();
            let is_of_key = name == prefix || name.bytes().all(|byte| byte.is_ascii_digit());
            links_left = links_left.saturating_sub(usize::from(is_of_key));
            is_of_key && links_left > 0
        };
        let mut left = vec![(self.folder.clone(), full)];
        std::iter::from_fn(move || {
            loop {
                let (path, depth) = left.pop()?;
                if !path.is_dir() {
                    return Some(path);
                }
                let is_link = depth < full && path.is_symlink();
                if depth > 0 && (!is_link || may_follow(&path)) {
                    let entries = std::fs::read_dir(&path).into_iter().flatten().flatten();
                    left.extend(entries.map(|entry| (entry.path(), depth - 1)));
                }
            }
        })
    }

    /// Bytes to which the files of chunks may decode, each at most `ratio` times as long as it is; counting stops at
    /// `enough`.
    pub fn promised_bytes(&self, ratio: u64, enough: u64) -> u64 {
        let of_file = self.file_bytes();
        let bytes = |path: PathBuf| {
            let name = path.strip_prefix(&self.folder).ok()?;
            self.has_chunk(&self.keys.place(name)?).then_some(())?;
            let length = std::fs::metadata(&path).ok()?.len();
            Some(length.saturating_mul(ratio).min(of_file))
        };
        let mut found: u64 = 0;
        for bytes in self.files().filter_map(bytes) {
            found = found.saturating_add(bytes);
            if found >= enough {
                break;
            }
        }
        found
    }

    /// Whether a file at this position of the grid holds voxels.
    fn has_chunk(&self, place: &[u64]) -> bool {
        let sides = self.shape.iter().zip(self.file_shape());
        let is_inside = |(n, (length, side)): (&u64, (&u64, &u64))| *n < length.div_ceil(*side);
        place.len() == self.shape.len() && place.iter().zip(sides).all(is_inside)
    }
}
