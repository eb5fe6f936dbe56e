//! Files under temporary names, which become outputs or stores by a rename once they are whole.
//!
//! Dropping one removes it. A process that ends without dropping anything calls [`remove_all`] first. What a process
//! leaves that is killed is removed by a later one: a file is locked as long as somebody writes it, so that one
//! without a lock is abandoned. Not every file system has locks; where there are none, nobody takes a file for
//! abandoned. Some network file systems have locks that other machines do not see: so a name ends with that of the machine,
//! and a file of another machine is abandoned only if it has not been written for a week.

use std::fs::{self, File};
use std::io;
use std::path::{Path, PathBuf};
use std::sync::Mutex;
use std::time::Duration;

use tempfile::NamedTempFile;

use crate::locked::locked;

const WEEK: Duration = Duration::from_secs(7 * 24 * 3600);

/// Files under temporary names that may be there now.
static NAMES: Mutex<Vec<PathBuf>> = Mutex::new(Vec::new());

/// Removes all files that are still under temporary names. Nothing can be written from then on: the process has to
/// end.
#[cfg(feature = "cli")]
pub fn remove_all() {
    let names = locked(&NAMES);
    for name in names.iter() {
        // It may have its final name already.
        let _ = fs::remove_file(name);
    }
    std::mem::forget(names);
}

/// A file under a temporary name, which is removed when this is dropped.
pub struct Temporary {
    pub file: NamedTempFile,
    // Declared last, so that it is dropped after the file: the name stays on the list until the file is removed.
    _listed: Listed,
}

/// A name on the list of those that [`remove_all`] removes, until it is dropped.
pub struct Listed(PathBuf);

impl Listed {
    pub fn new(path: PathBuf) -> Listed {
        let mut names = locked(&NAMES);
        names.push(path.clone());
        Listed(path)
    }
}

impl Drop for Listed {
    fn drop(&mut self) {
        let mut names = locked(&NAMES);
        names.retain(|name| *name != self.0);
    }
}

/// Makes a file with a new name that begins with `prefix`, and locks it.
pub fn create(folder: &Path, prefix: &str) -> io::Result<Temporary> {
    loop {
        let temporary = create_without_lock(folder, prefix)?;
        let _ = temporary.file.as_file().lock();
        // Another process may have found it before it was locked.
        if temporary.file.path().exists() {
            return Ok(temporary);
        }
    }
}

impl Temporary {
    /// Gives the file its final name.
    pub fn persist(self, path: &Path) -> io::Result<()> {
        let Temporary { file, _listed } = self;
        file.persist(path).map(drop).map_err(|failed| failed.error)
    }
}

/// Removes what killed processes have left under names that begin with `prefix`. What cannot be removed stays.
pub fn remove_abandoned(folder: &Path, prefix: &str) {
    for entry in fs::read_dir(folder).into_iter().flatten().flatten() {
        if entry.file_name().to_string_lossy().starts_with(prefix)
            && let Some(_lock) = abandoned(&entry.path())
        {
            let _ = fs::remove_file(entry.path());
        }
    }
}

/// The lock of a temporary file that nobody writes any more, to be held until the file is removed: whoever has just made it
/// waits for the lock, and then makes another one.
pub fn abandoned(path: &Path) -> Option<File> {
    // NFS locks only what is open for writing.
    let file = File::options().write(true).open(path).ok()?;
    let shows_its_lock = path.to_string_lossy().ends_with(&suffix()) || is_old(&file);
    (shows_its_lock && file.try_lock().is_ok()).then_some(file)
}

/// Whether a file has not been written for so long that nobody writes it any more, on whatever machine.
fn is_old(file: &File) -> bool {
    let written = file.metadata().and_then(|metadata| metadata.modified());
    let age = written.ok().and_then(|written| written.elapsed().ok());
    age.is_some_and(|age| age > WEEK)
}

/// How temporary names end on this machine.
fn suffix() -> String {
    let host = sysinfo::System::host_name().unwrap_or_default();
    format!(".{}", host.replace(['/', '.'], "-"))
}

/// The error of the system alone: a temporary name means nothing to a user.
fn without_path(error: io::Error) -> io::Error {
    let wrapped = error.get_ref().and_then(|error| error.source());
    let of_system = wrapped.and_then(|error| error.downcast_ref::<io::Error>());
    match of_system.and_then(io::Error::raw_os_error) {
        Some(code) => io::Error::from_raw_os_error(code),
        None => error,
    }
}

fn create_without_lock(folder: &Path, prefix: &str) -> io::Result<Temporary> {
    let mut builder = tempfile::Builder::new();
    let suffix = suffix();
    builder.prefix(prefix).suffix(&suffix);
    // Temporary files are private by default; these have the permissions of any new file.
    #[cfg(unix)]
    {
        use std::os::unix::fs::PermissionsExt;
        builder.permissions(fs::Permissions::from_mode(0o666));
    }
    // Whoever removes all files on the list must not miss this one.
    let mut names = locked(&NAMES);
    let file = builder.tempfile_in(folder).map_err(without_path)?;
    let path = file.path().to_owned();
    names.push(path.clone());
    Ok(Temporary {
        file,
        _listed: Listed(path),
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_nobody_writes_is_abandoned_on_other_machines_after_a_week() {
        let folder = tempfile::tempdir().expect("a folder");
        let prefix = ".isolume-test-";
        let written = create(folder.path(), prefix).expect("a file");
        let [left, other, old] = ["", ".another-machine", ".an-old-machine"].map(|host| {
            let host = if host.is_empty() {
                suffix()
            } else {
                host.into()
            };
            folder.path().join(format!("{prefix}left{host}"))
        });
        for path in [&left, &other, &old] {
            fs::write(path, "half").expect("a file");
        }
        let before = std::time::SystemTime::now() - 2 * WEEK;
        let file = File::options().write(true).open(&old).expect("a file");
        file.set_modified(before).expect("another time");
        remove_abandoned(folder.path(), prefix);
        assert!(written.file.path().exists() && other.exists());
        assert!(!left.exists() && !old.exists());
    }
}
