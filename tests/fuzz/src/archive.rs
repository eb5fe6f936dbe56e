//! A folder as one input: before each file stands a line with its path. So an input stays a folder whatever is inserted or
//! removed, which it would not with lengths.

use std::fs;
use std::path::{Component, Path};

use crate::folder;

const MARK: &[u8] = b"\n==> ";
const MOST_FILES: usize = 64;
const MOST_STEPS: usize = 8;

pub fn pack(files: &[(String, Vec<u8>)]) -> Vec<u8> {
    let pack = |(name, bytes): &(String, Vec<u8>)| [MARK, name.as_bytes(), b"\n", bytes].concat();
    files.iter().flat_map(pack).collect()
}

/// Writes the files. Those without a name, or with one that leads out of the folder, are left out.
pub fn unpack(mut bytes: &[u8], folder: &Path) {
    for _ in 0..MOST_FILES {
        let Some(begin) = find(bytes, MARK) else {
            return;
        };
        bytes = &bytes[begin + MARK.len()..];
        let file = &bytes[..find(bytes, MARK).unwrap_or(bytes.len())];
        let Some(line) = file.iter().position(|byte| *byte == b'\n') else {
            continue;
        };
        if let Ok(name) = str::from_utf8(&file[..line]) {
            write(folder, Path::new(name), &file[line + 1..]);
        }
    }
}

fn find(bytes: &[u8], wanted: &[u8]) -> Option<usize> {
    bytes.windows(wanted.len()).position(|part| part == wanted)
}

/// A name that the system refuses is left out as well.
fn write(folder: &Path, name: &Path, bytes: &[u8]) {
    let is_step = |step: Component| matches!(step, Component::Normal(_));
    let steps = name.components().count();
    if (1..=MOST_STEPS).contains(&steps) && name.components().all(is_step) {
        let path = folder.join(name);
        let _ = fs::create_dir_all(path.parent().unwrap_or(folder));
        let _ = fs::write(path, bytes);
    }
}

/// A seed: what a writer puts into an empty folder.
pub fn of(write: impl FnOnce(&Path)) -> Vec<u8> {
    let path = folder::empty("seed");
    write(&path);
    pack(&folder::contents(&path))
}
