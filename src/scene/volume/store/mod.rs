//! Copies of volumes that last from one run to the next.
//!
//! A volume that streams is read brick by brick, in any order. A file that cannot be read in this way (gzip, DICOM,
//! strips of TIFF) is copied once into a *store*: one file in a folder for stores, with the stored values in chunks
//! that are each compressed on their own ([`file`]), and with everything that would take a scan of the voxels to
//! find out. So a second run neither scans nor copies. If the volume itself can be read in any order, only the
//! results of the scan are kept.
//!
//! A store has its name from the volume's path and from the user's settings for it, so that a file that has changed
//! gets its store replaced. Whether a store belongs to the volume is decided by its identity: the lengths of all files and the
//! times at which they have changed, and everything else that affects a stored value.
//!
//! A store is written under a temporary name and renamed once it is complete and on the disk ([`write`]). Two
//! processes that copy one volume at a time write two files, and the later rename replaces a file by its equal. A
//! temporary file is locked while it is written; one without a lock is left over from a killed process.

pub mod clean;
pub mod file;
mod layout;
mod write;

use std::fmt;
use std::fs::Metadata;
use std::path::{Path, PathBuf};
use std::sync::Arc;

use xxhash_rust::xxh3::{Xxh3, xxh3_64};

use super::format::header::Header;
use super::overrides::VolumeOverrides;
use super::parsed::Parsed;
use super::region::Region;
use super::scan::Extremes;
use super::stored::StoredType;
use super::voxel_type::Endian;
use crate::error::Result;
use crate::regular_file::Version;
use file::Known;

/// Raised with every change of a store's bytes or of the values in it.
const FORMAT: u32 = 3;
/// How the name of a store ends.
const SUFFIX: &str = ".isolume-store";
/// How the temporary name of a store begins.
const PREFIX: &str = ".isolume-store-";

/// The folder of the stores, and a callback for the progress of copies.
#[derive(Clone)]
pub struct Stores {
    folder: PathBuf,
    tell: Arc<Tell>,
}

/// A callback that is told about a copy at its beginning, at intervals, and at its end; its error ends the copy.
pub type Tell = dyn Fn(&Copying) -> Result<()> + Send + Sync;

/// A copy in progress.
#[derive(Debug, Clone, Copy)]
pub struct Copying<'a> {
    /// The file's name, as the user has given it.
    pub volume: &'a str,
    pub folder: &'a Path,
    /// From 0 to 1.
    pub share: f64,
}

impl fmt::Debug for Stores {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("Stores")
            .field("folder", &self.folder)
            .finish_non_exhaustive()
    }
}

impl Stores {
    /// The folder need not exist.
    pub fn new(
        folder: PathBuf,
        tell: impl Fn(&Copying) -> Result<()> + Send + Sync + 'static,
    ) -> Stores {
        Stores {
            folder,
            tell: Arc::new(tell),
        }
    }

    /// The file for a volume. `None` if one of its files cannot be examined.
    pub(super) fn store_file(
        &self,
        path: &Path,
        overrides: &VolumeOverrides,
        header: &Header,
        files: &[PathBuf],
        region: Region,
        is_mirrored: bool,
    ) -> Option<StoreFile> {
        let path = path.canonicalize().ok()?;
        // The size of voxels does not affect their values.
        let overrides = VolumeOverrides {
            spacing: None,
            ..overrides.clone()
        };
        let named = format!("{path:?} {overrides:?}");
        let meaning = (header.dims, header.voxel_type, header.endian);
        let rescale = (header.slope, header.intercept);
        let mut identity = Xxh3::new();
        let turned = (is_mirrored, Endian::NATIVE);
        let described = format!("{FORMAT} {named} {meaning:?} {rescale:?} {region:?} {turned:?}");
        identity.update(described.as_bytes());
        let header_file = path.is_file().then_some(&path);
        for file in header_file.into_iter().chain(files) {
            let state = state(&std::fs::metadata(file).ok()?);
            identity.update(format!("\n{file:?} {state}").as_bytes());
        }
        Some(StoreFile {
            stores: self.clone(),
            name: format!("{:016x}", xxh3_64(named.as_bytes())),
            identity: identity.digest128(),
            dims: region.dims,
        })
    }
}

/// What tells a file's content from another that it has had. Its time of modification may have been set, as by `cp -p` and by
/// archives; that of its last change, if the system has one, cannot be.
fn state(metadata: &Metadata) -> String {
    #[cfg(unix)]
    let changed = {
        use std::os::unix::fs::MetadataExt;
        Some((metadata.ctime(), metadata.ctime_nsec()))
    };
    #[cfg(not(unix))]
    let changed: Option<(i64, i64)> = None;
    let Version { bytes, modified } = Version::of(metadata);
    format!("{:?} {changed:?}", (bytes, modified))
}

/// Where the store of one volume is, or would be.
#[derive(Debug, Clone)]
pub struct StoreFile {
    stores: Stores,
    name: String,
    identity: u128,
    dims: [u32; 3],
}

impl StoreFile {
    fn path(&self) -> PathBuf {
        self.stores.folder.join(self.name.clone() + SUFFIX)
    }

    /// The contents of the store for a volume with this stored type; `None` if there is none for its current state.
    ///
    /// # Errors
    ///
    /// If there is a store, but it is damaged.
    pub(super) fn find(&self, stored: StoredType) -> Parsed<Option<Known>> {
        let path = self.path();
        if path.is_file() {
            file::open(&path, self.identity, self.dims, stored)
                .map_err(|fault| format!("its store {} is damaged: {fault}", path.display()))
        } else {
            Ok(None)
        }
    }
}

/// A file for a volume, and what is kept there beside the volume's statistics.
#[derive(Debug)]
pub(super) struct Keeping {
    pub store_file: StoreFile,
    pub extremes: Extremes,
}

#[cfg(all(test, unix))]
mod tests {
    use super::*;

    #[test]
    fn another_content_is_noticed_whatever_time_the_file_is_given() {
        let folder = tempfile::tempdir().expect("a folder");
        let path = folder.path().join("voxels.raw");
        let state_with = |content: &str| {
            std::fs::write(&path, content).expect("a file");
            let file = std::fs::File::options()
                .write(true)
                .open(&path)
                .expect("a file");
            file.set_modified(std::time::UNIX_EPOCH).expect("a time");
            state(&file.metadata().expect("its metadata"))
        };
        let before = state_with("one");
        // Longer than a tick of the clock by which the system dates changes.
        std::thread::sleep(std::time::Duration::from_millis(50));
        assert_ne!(state_with("two"), before);
    }
}
