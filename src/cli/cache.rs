//! Where stores are kept.

use std::path::PathBuf;

use clap::Args;

use crate::cache_dir::cache_dir;
use crate::error::{Error, Result};
use crate::output::progress::copying;
use crate::scene::volume::{Copying, Stores};

#[derive(Debug, Args)]
pub struct CacheArgs {
    /// Folder of stores: data kept of volumes that do not fit the GPU, such as copies of compressed files; by default
    /// `isolume` in $XDG_CACHE_HOME or ~/.cache.
    #[arg(long, value_name = "DIR")]
    cache_dir: Option<PathBuf>,
}

impl CacheArgs {
    /// The folder for stores; `None` if none is named and the system has none.
    pub fn folder(&self) -> Option<PathBuf> {
        self.cache_dir.clone().or_else(cache_dir)
    }

    /// The stores in that folder. They report the progress of copies on stderr, and stop once `is_over`.
    pub fn stores(
        &self,
        quiet: bool,
        is_over: impl Fn() -> bool + Send + Sync + 'static,
    ) -> Option<Stores> {
        let show = copying(quiet);
        let tell = move |copy: &Copying<'_>| -> Result<()> {
            show(copy);
            if is_over() {
                Err(Error::Interrupted)
            } else {
                Ok(())
            }
        };
        self.folder().map(|folder| Stores::new(folder, tell))
    }
}

#[derive(Debug, Args)]
pub struct CleanArgs {
    #[command(flatten)]
    pub cache: CacheArgs,
}
