//! Where files are kept that only save time: deleting them loses nothing else.

use std::path::PathBuf;

/// Isolume's folder for them, which may not exist yet: `isolume` in `$XDG_CACHE_HOME` or `~/.cache`, in
/// `~/Library/Caches` on a Mac, in `%LOCALAPPDATA%` on Windows. `None` where the environment names no such place.
pub fn cache_dir() -> Option<PathBuf> {
    let named = |variable: &str| {
        let path = PathBuf::from(std::env::var_os(variable)?);
        path.is_absolute().then_some(path)
    };
    let caches = if cfg!(windows) {
        named("LOCALAPPDATA")
    } else if cfg!(target_os = "macos") {
        named("HOME").map(|home| home.join("Library/Caches"))
    } else {
        named("XDG_CACHE_HOME").or_else(|| Some(named("HOME")?.join(".cache")))
    };
    Some(caches?.join("isolume"))
}
