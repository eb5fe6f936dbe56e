//! Pictures in parts: shards of a picture's samples, which merge to the picture that one run would have rendered, and
//! checkpoints, from which a render continues.
//!
//! Both are EXR files that show a picture and hold the sums behind it at full precision. A header says which picture
//! they belong to ([`Identity`]) and which samples they hold: parts of different pictures are never put together.

mod cache_file;
mod checkpoint;
mod file;
mod fingerprint;
mod fingerprints;
mod header;
mod identity;
mod lock;
mod merge;
mod settings;

use std::path::{Path, PathBuf};

use crate::output::target_of;

pub use cache_file::{About, CacheFile};
pub use checkpoint::{Found, Manner, RunOf, State};
pub use file::{Pixels, read_header};
pub use fingerprint::Fingerprint;
pub use fingerprints::Fingerprints;
pub use header::{Fill, Header};
pub use identity::{Identity, Named};
pub use merge::{Merged, check_kept, merge};
pub use settings::Settings;

/// The files that lie beside a checkpoint: the cache's state, and a lock.
pub fn side_files(checkpoint: &Path) -> [PathBuf; 2] {
    ["cache", "lock"].map(|extension| beside(checkpoint, extension))
}

/// The file of this kind beside a checkpoint: `FILE.exr.cache`. A checkpoint that is named through a symbolic link is the
/// file behind it.
fn beside(checkpoint: &Path, extension: &str) -> PathBuf {
    let mut name = target_of(checkpoint).into_os_string();
    name.push(".");
    name.push(extension);
    name.into()
}

#[cfg(all(test, unix))]
mod tests {
    use super::*;

    #[test]
    fn a_link_to_a_checkpoint_has_its_lock() {
        let folder = tempfile::tempdir().expect("a folder");
        let [file, link] = ["c.exr", "link.exr"].map(|name| folder.path().join(name));
        std::os::unix::fs::symlink("c.exr", &link).expect("a link");
        for exists in [false, true] {
            assert_eq!(beside(&link, "lock"), beside(&file, "lock"), "{exists}");
            std::fs::write(&file, "").expect("a file");
        }
    }
}
