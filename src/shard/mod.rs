//! Pictures in parts: shards of a picture's samples, which merge to the picture that one run would have rendered, and
//! checkpoints, from which a render continues.
//!
//! Both are EXR files that show a picture and hold the sums behind it at full precision. A header says which picture
//! they belong to ([`Identity`]) and which samples they hold: parts of different pictures are never put together.

mod cache_file;
mod checkpoint;
mod file;
mod fingerprint;
mod header;
mod identity;
mod lock;
mod merge;
mod settings;

use std::path::{Path, PathBuf};

pub use cache_file::{About, CacheFile};
pub use checkpoint::{Found, RunOf, State};
pub use file::{Shard, read_header};
pub use fingerprint::Fingerprint;
pub use header::{Fill, Header};
pub use identity::{Identity, Named, volume_fingerprint};
pub use merge::{Merged, check_kept, merge};
pub use settings::Settings;

/// The files that lie beside a checkpoint: the cache's state, and a lock.
pub fn side_files(checkpoint: &Path) -> [PathBuf; 2] {
    ["cache", "lock"].map(|extension| beside(checkpoint, extension))
}

/// The file of this kind beside a checkpoint: `FILE.exr.cache`.
fn beside(checkpoint: &Path, extension: &str) -> PathBuf {
    let mut name = checkpoint.as_os_str().to_owned();
    name.push(".");
    name.push(extension);
    name.into()
}
