//! Files that appear whole or not at all.
//!
//! Each output is first written to a temporary file next to its final name, because only a rename within one file
//! system is atomic. Outputs that belong together are all written before the first is renamed: a disk that fills up
//! half way leaves none of them. The pictures of a render are independent: if one of them cannot be written, the others
//! still are. Dropping [`Outputs`] removes those that were not committed. A process that is about to end without
//! dropping them calls [`temporary::remove_all`].

use std::collections::HashSet;
use std::fs::{self, File};
use std::io::{self, BufWriter, Write};
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicBool, Ordering};
#[cfg(unix)]
use std::time::Duration;

use serde::Serialize;

use super::{Continuation, Provenance, exr, png, say};
use crate::engine::Picture;
use crate::error::{Error, Result};
use crate::scene::Tone;
use crate::temporary::{self, Temporary};

/// How the temporary names of outputs begin.
const PREFIX: &str = ".isolume-output-";

/// Whether any output of this process has got its final name.
static HAS_COMMITTED: AtomicBool = AtomicBool::new(false);

pub fn has_committed() -> bool {
    HAS_COMMITTED.load(Ordering::Relaxed)
}

/// Whether outputs do without pipes that nobody reads.
static WAITS_NO_LONGER: AtomicBool = AtomicBool::new(false);

/// From now on, an output into a pipe that nobody reads fails. Before, it waits for a reader, as pipes do.
pub fn wait_no_longer() {
    WAITS_NO_LONGER.store(true, Ordering::Relaxed);
}

/// The outputs of a run before they get their final names.
#[derive(Default)]
pub struct Outputs {
    pending: Vec<Pending>,
    /// Whether each is worth having without the others.
    are_independent: bool,
    /// Why independent ones could not be written.
    lost: Vec<Error>,
}

struct Pending {
    /// The name that the user gave, for messages.
    path: PathBuf,
    target: Target,
    temporary: Temporary,
}

/// Where the bytes end up.
enum Target {
    File(PathBuf),
    /// A pipe or a device such as /dev/null: a rename would replace it by an ordinary file.
    Stream(PathBuf),
}

impl Outputs {
    /// Outputs each of which gets its name whatever becomes of the others: [`commit`](Outputs::commit) reports those that
    /// could not be written.
    pub fn independent() -> Outputs {
        Outputs {
            are_independent: true,
            ..Outputs::default()
        }
    }

    pub fn exr(&mut self, path: &Path, picture: &Picture, provenance: &Provenance) -> Result<()> {
        self.write_aside(path, |file| exr::encode(file, picture, provenance, None))
    }

    /// Writes the EXR of a picture that another run may continue.
    pub fn exr_with(
        &mut self,
        path: &Path,
        picture: &Picture,
        provenance: &Provenance,
        continuation: Continuation<'_>,
    ) -> Result<()> {
        self.write_aside(path, |file| {
            exr::encode(file, picture, provenance, Some(continuation))
        })
    }

    pub fn png(&mut self, path: &Path, picture: &Picture, exposure: f64, tone: Tone) -> Result<()> {
        self.write_aside(path, |file| png::encode(file, picture, exposure, tone))
    }

    pub fn json(&mut self, path: &Path, value: &impl Serialize) -> Result<()> {
        self.write_aside(path, |file| {
            serde_json::to_writer_pretty(&mut *file, value)?;
            writeln!(file)
        })
    }

    pub fn text(&mut self, path: &Path, text: &str) -> Result<()> {
        self.write_aside(path, |file| file.write_all(text.as_bytes()))
    }

    /// Writes a file of any kind under a temporary name.
    pub fn write_aside(
        &mut self,
        path: &Path,
        write: impl FnOnce(&mut BufWriter<&mut File>) -> io::Result<()>,
    ) -> Result<()> {
        let written = Pending::write(path, write).map(|file| self.pending.push(file));
        self.tolerate(written)
    }

    /// Gives every file its final name.
    pub fn commit(mut self) -> Result<()> {
        for file in std::mem::take(&mut self.pending) {
            let committed = file.commit();
            self.tolerate(committed)?;
        }
        let mut lost = self.lost.into_iter();
        let first = lost.next();
        for other in lost {
            say(format!("note: {other}"));
        }
        first.map_or(Ok(()), Err)
    }

    /// Puts an error aside where the other outputs are independent of it.
    fn tolerate(&mut self, done: Result<()>) -> Result<()> {
        match done {
            Err(error) if self.are_independent => {
                self.lost.push(error);
                Ok(())
            }
            done => done,
        }
    }
}

impl Pending {
    fn write(
        path: &Path,
        write: impl FnOnce(&mut BufWriter<&mut File>) -> io::Result<()>,
    ) -> Result<Pending> {
        let (target, mut temporary) = open(path)?;
        let mut file = BufWriter::new(temporary.file.as_file_mut());
        write(&mut file)
            .and_then(|()| file.flush())
            // Some file systems report a full disk only here.
            .and_then(|()| file.get_ref().sync_all())
            .map_err(|error| Error::io(path, error))?;
        drop(file);
        Ok(Pending {
            path: path.to_owned(),
            target,
            temporary,
        })
    }

    /// Gives the file its final name.
    fn commit(self) -> Result<()> {
        let mut temporary = self.temporary;
        let (done, target) = match self.target {
            Target::File(target) => (temporary.persist(&target), target),
            Target::Stream(target) => (copy(temporary.file.as_file_mut(), &target), target),
        };
        done.map_err(|error| Error::io(&self.path, error))?;
        HAS_COMMITTED.store(true, Ordering::Relaxed);
        sync_folder(&target);
        Ok(())
    }
}

/// Checks whether outputs could be written to these paths, each to a file of its own: to be called before the long
/// work, not after. Removes temporary files that killed processes have left in those folders.
pub fn check_writable<'a>(paths: impl IntoIterator<Item = &'a PathBuf>) -> Result<()> {
    let mut taken: HashSet<PathBuf> = HashSet::new();
    let mut cleared: HashSet<PathBuf> = HashSet::new();
    for path in paths {
        let (target, temporary) = open(path)?;
        if let Some(folder) = temporary.file.path().parent()
            && !cleared.contains(folder)
        {
            temporary::remove_abandoned(folder, PREFIX);
            cleared.insert(folder.to_owned());
        }
        let Target::File(file) = target else {
            continue;
        };
        let Some(name) = file.file_name() else {
            continue;
        };
        // The folder exists; the file may not.
        let folder = temporary.file.path().parent().map(fs::canonicalize);
        let folder = folder.and_then(Result::ok).unwrap_or_default();
        let file = fs::canonicalize(&file).unwrap_or(folder.join(name));
        if !taken.insert(file) {
            return Err(Error::Usage(format!(
                "{}: two outputs have this name; give each its own",
                path.display()
            )));
        }
    }
    Ok(())
}

/// Fails if an output would take the place of a file that is read, as `sky.exr` would of the image that lights `sky.toml`.
pub fn check_inputs_stay<'a>(
    outputs: impl IntoIterator<Item = &'a PathBuf>,
    inputs: &[PathBuf],
) -> Result<()> {
    let real = |path: &PathBuf| path.canonicalize().ok();
    let existing = outputs
        .into_iter()
        .filter_map(|output| Some((output, real(output)?)));
    let existing: Vec<(&PathBuf, PathBuf)> = existing.collect();
    if existing.is_empty() {
        return Ok(());
    }
    let inputs: HashSet<PathBuf> = inputs.iter().filter_map(real).collect();
    for (output, path) in existing {
        if inputs.contains(&path) {
            return Err(Error::Usage(format!(
                "{}: this file is read, and an output would take its place; give the output another name",
                output.display()
            )));
        }
    }
    Ok(())
}

fn open(path: &Path) -> Result<(Target, Temporary)> {
    let is_folder = path.as_os_str().as_encoded_bytes().ends_with(b"/");
    let target = match fs::metadata(path) {
        Ok(existing) if existing.is_dir() => {
            return Err(Error::input(path, "it is a folder; name a file in it"));
        }
        _ if is_folder => return Err(Error::input(path, "it names a folder; name a file")),
        // The path may be a symbolic link: the link stays.
        Ok(existing) if existing.is_file() => {
            Target::File(fs::canonicalize(path).map_err(|error| Error::io(path, error))?)
        }
        Ok(_) => Target::Stream(path.to_owned()),
        Err(error) if error.kind() == io::ErrorKind::InvalidFilename => {
            return Err(Error::io(path, error));
        }
        Err(_) => Target::File(target_of(path)),
    };
    let folder = match &target {
        Target::File(file) => match file.parent() {
            Some(parent) if parent != Path::new("") => parent.to_owned(),
            _ => PathBuf::from("."),
        },
        Target::Stream(_) => std::env::temp_dir(),
    };
    let is_there = match fs::metadata(&folder) {
        Ok(there) => there.is_dir(),
        Err(error) if error.kind() == io::ErrorKind::NotFound => false,
        Err(error) => return Err(Error::io(path, error)),
    };
    if !is_there {
        let problem = format!(
            "the folder {} does not exist; create it first",
            folder.display()
        );
        return Err(Error::input(path, problem));
    }
    let temporary = temporary::create(&folder, PREFIX).map_err(|error| Error::io(path, error))?;
    Ok((target, temporary))
}

/// Where a symbolic link leads in the end, whether there is a file or not; other paths lead to themselves.
pub fn target_of(path: &Path) -> PathBuf {
    const MOST_LINKS: usize = 40;
    let mut target = path.to_owned();
    for _ in 0..MOST_LINKS {
        let (Ok(next), Some(folder)) = (fs::read_link(&target), target.parent()) else {
            break;
        };
        target = folder.join(next);
    }
    target
}

/// Asks the disk to keep a new name, where it can: without this the file may have its old content after a power cut.
fn sync_folder(path: &Path) {
    let folder = path.parent().filter(|folder| *folder != Path::new(""));
    let folder = File::open(folder.unwrap_or(Path::new(".")));
    let _ = folder.and_then(|folder| folder.sync_all());
}

/// Waits until a pipe has a reader, as opening it does, unless an interruption ends that. Keep what is returned until the pipe
/// is open: without it, the reader would be told that the pipe has ended.
#[cfg(unix)]
fn wait_for_reader(stream: &Path) -> io::Result<Option<File>> {
    use std::os::unix::fs::{FileTypeExt, OpenOptionsExt};

    const PAUSE: Duration = Duration::from_millis(20);
    if !fs::metadata(stream)?.file_type().is_fifo() {
        return Ok(None);
    }
    let mut at_once = File::options();
    at_once.write(true).custom_flags(libc::O_NONBLOCK);
    loop {
        match at_once.open(stream) {
            Err(error) if error.raw_os_error() == Some(libc::ENXIO) => {
                if WAITS_NO_LONGER.load(Ordering::Relaxed) {
                    return Err(io::Error::other("nobody reads from this pipe"));
                }
                std::thread::sleep(PAUSE);
            }
            opened => return opened.map(Some),
        }
    }
}

fn copy(from: &mut File, stream: &Path) -> io::Result<()> {
    io::Seek::rewind(from)?;
    #[cfg(unix)]
    let _reader = wait_for_reader(stream)?;
    let mut stream = File::options().write(true).open(stream)?;
    io::copy(from, &mut stream).map(drop)
}
