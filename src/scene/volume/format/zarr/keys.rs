//! The names of chunks' files, and which files of an array's folder are chunks.

use std::path::{Path, PathBuf};

use super::array::Array;

/// Links to folders that are followed: they may lead round in circles.
const MOST_LINKS: usize = 1 << 16;

/// How the name of a file is made from the position of its chunk.
#[derive(Debug)]
pub struct Keys {
    pub prefix: &'static str,
    pub separator: char,
}

impl Keys {
    pub fn key(&self, place: &[u64]) -> String {
        let prefix = (!self.prefix.is_empty()).then(|| self.prefix.to_string());
        let numbers = place.iter().map(u64::to_string);
        let parts: Vec<String> = prefix.into_iter().chain(numbers).collect();
        parts.join(&self.separator.to_string())
    }

    /// The position of the chunk whose file, seen from the array's folder, has this path.
    fn place(&self, path: &Path) -> Option<Vec<u64>> {
        let parts: Option<Vec<&str>> = path.iter().map(|part| part.to_str()).collect();
        let key = parts?.join("/");
        let numbers = match self.prefix {
            "" => &key,
            prefix => key.strip_prefix(prefix)?.strip_prefix(self.separator)?,
        };
        let numbers = numbers.split(self.separator);
        let place: Vec<u64> = numbers.map(|n| n.parse().ok()).collect::<Option<_>>()?;
        (self.key(&place) == key).then_some(place)
    }
}

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

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn only_a_chunk_s_key_is_a_place() {
        for (prefix, separator, path, place) in [
            ("c", '/', "c/0/12/3", Some(vec![0, 12, 3])),
            ("c", '.', "c.0.12", Some(vec![0, 12])),
            ("", '.', "7", Some(vec![7])),
            ("", '/', "1/2", Some(vec![1, 2])),
            ("", '/', "1.2", None),
            ("", '.', "1/2", None),
            ("c", '/', "0/1", None),
            ("", '/', "c/0/1", None),
            ("", '.', "01.2", None),
            ("", '.', "+1.2", None),
            ("", '.', ".zarray", None),
            ("", '.', "", None),
            ("", '/', "thumbnails/1", None),
        ] {
            let keys = Keys { prefix, separator };
            assert_eq!(keys.place(Path::new(path)), place, "{path}");
        }
    }
}
