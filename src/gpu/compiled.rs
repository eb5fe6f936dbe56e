//! Results of slow compilation, kept on disk for the next start: the shaders' SPIR-V, and the pipelines that the
//! driver has made of it.
//!
//! A folder belongs to one version of the shaders, so that nothing in it is ever out of date: a program with other
//! shaders uses another one, and removes all but the last few. Each file states its own name, length and hash, since
//! a driver trusts the data that it is given: a file that is broken, cut short or not ours counts as missing. Files
//! are written aside and renamed, and no failure on the way is an error: a start then takes as long as the first one
//! did.

use std::fs;
use std::io::Write;
use std::path::{Path, PathBuf};
use std::time::SystemTime;

use xxhash_rust::xxh3::xxh3_128;

use crate::cache_dir::cache_dir;
use crate::temporary;

const MAGIC: [u8; 8] = *b"isolume1";
/// The magic number and the hash of all that follows it: the name, a zero, the contents.
const HEADER_BYTES: usize = MAGIC.len() + size_of::<u128>();
/// A larger file is not ours.
const MOST_BYTES: u64 = 256 << 20;
/// The most files in a folder: scenes of every kind need a few hundred.
const MOST_FILES: usize = 1000;
/// The beginning of temporary names.
const PREFIX: &str = ".isolume-compiled-";
/// Folders of other versions that are kept beside the own one.
const OTHER_VERSIONS: usize = 3;

/// A folder of compiled code.
#[derive(Clone)]
pub(super) struct Compiled {
    /// `None`: nothing is kept.
    folder: Option<PathBuf>,
}

impl Compiled {
    /// The folder of the shaders with this hash, in the user's folder for caches.
    pub fn of_version(hash: u128) -> Compiled {
        let all = cache_dir().map(|dir| dir.join("pipelines"));
        Compiled::within(all, hash)
    }

    fn within(all: Option<PathBuf>, hash: u128) -> Compiled {
        Compiled {
            folder: all.map(|all| all.join(format!("{hash:032x}"))),
        }
    }

    /// The contents that were last stored under this name.
    pub fn load(&self, name: &str) -> Option<Vec<u8>> {
        let path = self.folder.as_ref()?.join(name);
        let length = fs::metadata(&path).ok()?.len();
        let mut bytes = if length <= MOST_BYTES {
            fs::read(&path).ok()?
        } else {
            return None;
        };
        let start = HEADER_BYTES + name.len() + 1;
        let header = bytes.get(..HEADER_BYTES)?;
        let is_ours = header == Compiled::header(&bytes[HEADER_BYTES..])
            && bytes.get(HEADER_BYTES..start)? == [name.as_bytes(), &[0]].concat();
        is_ours.then(|| bytes.split_off(start))
    }

    pub fn store(&self, name: &str, contents: &[u8]) {
        if let Some(folder) = &self.folder {
            // A disk that is full or cannot be written costs time at the next start, and nothing else.
            let _ = Compiled::write(folder, name, contents);
        }
    }

    fn write(folder: &Path, name: &str, contents: &[u8]) -> std::io::Result<()> {
        if !folder.is_dir() {
            fs::create_dir_all(folder)?;
            remove_older_than_the_last_few(folder);
        }
        temporary::remove_abandoned(folder, PREFIX);
        let path = folder.join(name);
        if !path.exists() && fs::read_dir(folder)?.count() >= MOST_FILES {
            return Ok(());
        }
        let body = [name.as_bytes(), &[0], contents].concat();
        let mut temporary = temporary::create(folder, PREFIX)?;
        temporary.file.write_all(&Compiled::header(&body))?;
        temporary.file.write_all(&body)?;
        temporary.persist(&path)
    }

    fn header(body: &[u8]) -> [u8; HEADER_BYTES] {
        let mut header = [0; HEADER_BYTES];
        header[..MAGIC.len()].copy_from_slice(&MAGIC);
        header[MAGIC.len()..].copy_from_slice(&xxh3_128(body).to_le_bytes());
        header
    }
}

/// Removes the folders beside `own`, except for the few that were last written to.
fn remove_older_than_the_last_few(own: &Path) {
    let Some(siblings) = own.parent().and_then(|all| fs::read_dir(all).ok()) else {
        return;
    };
    let written = |path: &PathBuf| {
        let metadata = fs::metadata(path).and_then(|of| of.modified());
        metadata.unwrap_or(SystemTime::UNIX_EPOCH)
    };
    let mut others: Vec<PathBuf> = siblings
        .filter_map(|entry| Some(entry.ok()?.path()))
        .filter(|path| path != own)
        .collect();
    others.sort_by_key(|path| std::cmp::Reverse(written(path)));
    for old in others.iter().skip(OTHER_VERSIONS) {
        let _ = fs::remove_dir_all(old);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn in_folder(folder: &Path, hash: u128) -> Compiled {
        Compiled::within(Some(folder.join("pipelines")), hash)
    }

    #[test]
    fn what_is_stored_is_loaded_again_by_its_name_and_version() {
        let folder = tempfile::tempdir().expect("a folder");
        let compiled = in_folder(folder.path(), 1);
        assert_eq!(compiled.load("a"), None);
        compiled.store("a", b"code");
        assert_eq!(compiled.load("a"), Some(b"code".to_vec()));
        compiled.store("a", b"");
        assert_eq!(compiled.load("a"), Some(Vec::new()));
        assert_eq!(compiled.load("b"), None);
        assert_eq!(in_folder(folder.path(), 2).load("a"), None);
    }

    #[test]
    fn a_file_that_is_broken_cut_short_or_another_s_counts_as_missing() {
        let folder = tempfile::tempdir().expect("a folder");
        let compiled = in_folder(folder.path(), 1);
        compiled.store("a", b"some code");
        let path = compiled.folder.clone().expect("a folder").join("a");
        let whole = fs::read(&path).expect("a file");
        for length in 0..whole.len() {
            fs::write(&path, &whole[..length]).expect("a shorter file");
            assert_eq!(compiled.load("a"), None, "{length} bytes of it");
        }
        for at in 0..whole.len() {
            let mut broken = whole.clone();
            broken[at] ^= 0x10;
            fs::write(&path, &broken).expect("a broken file");
            assert_eq!(compiled.load("a"), None, "byte {at} is wrong");
        }
        fs::write(&path, [&whole[..], &[0]].concat()).expect("a longer file");
        assert_eq!(compiled.load("a"), None);
        fs::write(path.with_file_name("b"), &whole).expect("a file with another's contents");
        assert_eq!(compiled.load("b"), None);
    }

    #[test]
    fn a_folder_that_is_full_takes_new_contents_of_its_files_only() {
        let folder = tempfile::tempdir().expect("a folder");
        let compiled = in_folder(folder.path(), 1);
        for name in 0..MOST_FILES {
            compiled.store(&name.to_string(), b"old");
        }
        let file = |name: &str| compiled.folder.as_ref().expect("a folder").join(name);
        let left = temporary::create(&file(""), PREFIX).expect("a file");
        let (_, left) = left
            .file
            .keep()
            .expect("a file that a killed process leaves");
        compiled.store("7", b"new");
        compiled.store("another", b"new");
        assert!(!left.exists());
        assert_eq!(compiled.load("7"), Some(b"new".to_vec()));
        assert_eq!(compiled.load("another"), None);
    }

    #[test]
    fn a_place_that_cannot_be_written_is_no_error() {
        let folder = tempfile::tempdir().expect("a folder");
        let file = folder.path().join("pipelines");
        fs::write(&file, "in the way").expect("a file");
        let compiled = in_folder(folder.path(), 1);
        compiled.store("a", b"code");
        assert_eq!(compiled.load("a"), None);
        Compiled { folder: None }.store("a", b"code");
    }

    #[test]
    fn old_versions_go_when_a_new_one_comes() {
        let folder = tempfile::tempdir().expect("a folder");
        for version in 0..8 {
            in_folder(folder.path(), version).store("a", b"code");
            std::thread::sleep(std::time::Duration::from_millis(10));
        }
        let is_kept = |version| in_folder(folder.path(), version).load("a").is_some();
        let kept: Vec<u128> = (0..8).filter(|&version| is_kept(version)).collect();
        assert_eq!(kept, [4, 5, 6, 7]);
    }
}
