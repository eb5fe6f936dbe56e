//! The errors, sorted by whom they concern: each kind has its exit status.
//!
//! Every error holds the facts that its message is made of, so that a program which embeds the engine need not read
//! sentences. The message is one clear sentence that names the file, key or flag, what was found and what was expected. What
//! the command line's user can do about memory, time and devices is worded there, with the flags (`cli/message.rs`).

mod device;
mod memory;

use std::fmt::{self, Display, Formatter};
use std::io;
use std::path::{Path, PathBuf};
use std::time::Duration;

pub use device::DeviceError;
pub use memory::{MemoryError, unless_refused};

/// Exit status after Ctrl-C with the outputs written.
pub const INTERRUPTED_STATUS: u8 = 130;
/// Exit status after SIGTERM with the outputs written.
pub const TERMINATED_STATUS: u8 = 143;

/// Exit status where a device does not work.
pub const DEVICE_STATUS: u8 = 5;

pub type Result<T, E = Error> = std::result::Result<T, E>;

#[derive(Debug, thiserror::Error)]
pub enum Error {
    /// Wrong flags or arguments.
    #[error("{0}")]
    Usage(String),
    /// A file or folder cannot be read or written.
    #[error("{}: {source}", .path.display())]
    File { path: PathBuf, source: io::Error },
    /// A file's content, a scene or a value in it cannot be used.
    #[error("{location}{problem}")]
    Input { location: Location, problem: String },
    /// The time for a picture was over before there was one.
    #[error("after {:.1} s {lacking}", .spent.as_secs_f64())]
    TooShort {
        time: Duration,
        /// A little more than `time`, since a picture that is a little late is better than none.
        spent: Duration,
        lacking: Lacking,
    },
    /// Out of memory, or over the budget.
    #[error(transparent)]
    Memory(#[from] MemoryError),
    /// No usable Vulkan device, or it was lost.
    #[error(transparent)]
    Device(#[from] DeviceError),
    /// Ctrl-C or SIGTERM before there was anything to write.
    #[error("interrupted before there was a picture to write: nothing was written")]
    Interrupted,
}

/// What a picture has lacked when its time was over.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Lacking {
    /// Paths for all nodes of the cache.
    CachePaths,
    /// A sample of every pixel, by paths from the camera.
    Sample,
    /// A sample of every pixel, through the cache.
    SampleThroughCache,
}

impl Display for Lacking {
    fn fmt(&self, f: &mut Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Lacking::CachePaths => "the cache's nodes have not had their first paths",
            Lacking::Sample | Lacking::SampleThroughCache => {
                "not every pixel has had its first sample"
            }
        })
    }
}

/// Where input that cannot be used comes from.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub struct Location {
    pub origin: Origin,
    /// The dotted key in the scene, such as `light.0.direction`.
    pub key: Option<String>,
}

/// Who gave a value.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub enum Origin {
    /// A program, in a call.
    #[default]
    Call,
    /// A file or folder, by the name that it was given.
    File(String),
    /// A line of a file, counted from 1.
    Line { file: String, line: usize },
    /// A flag of the command line, as it was written.
    Flag(String),
}

impl Error {
    /// The process's exit status.
    pub fn exit_status(&self) -> u8 {
        match self {
            Error::Usage(_) => 2,
            Error::File { .. } | Error::Input { .. } | Error::TooShort { .. } => 3,
            Error::Memory(_) => 4,
            Error::Device(_) => DEVICE_STATUS,
            Error::Interrupted => INTERRUPTED_STATUS,
        }
    }

    /// A value that a program gave in a call.
    pub fn value(problem: impl Into<String>) -> Error {
        Error::input(Location::default(), problem)
    }

    /// A value that a user wrote in a file or on the command line.
    pub fn input(location: impl Into<Location>, problem: impl Into<String>) -> Error {
        Error::Input {
            location: location.into(),
            problem: problem.into(),
        }
    }

    /// A file that could not be read or written.
    pub fn io(path: &Path, source: io::Error) -> Error {
        Error::File {
            path: path.to_path_buf(),
            source,
        }
    }

    /// Whether a file or what is in it is the cause.
    pub fn is_about_input(&self) -> bool {
        matches!(self, Error::File { .. } | Error::Input { .. })
    }
}

impl Location {
    pub fn flag(flag: impl Into<String>) -> Location {
        Origin::Flag(flag.into()).into()
    }

    pub fn file(name: impl Into<String>) -> Location {
        Origin::File(name.into()).into()
    }

    pub fn with_key(self, key: impl Into<String>) -> Location {
        Location {
            key: Some(key.into()),
            ..self
        }
    }
}

impl From<Origin> for Location {
    fn from(origin: Origin) -> Location {
        Location { origin, key: None }
    }
}

impl From<&Path> for Location {
    fn from(path: &Path) -> Location {
        Location::file(path.display().to_string())
    }
}

/// The beginning of a message: empty, or with a colon at its end.
impl Display for Location {
    fn fmt(&self, f: &mut Formatter<'_>) -> fmt::Result {
        match &self.origin {
            Origin::Call => {}
            Origin::File(name) => write!(f, "{name}: ")?,
            Origin::Line { file, line } => write!(f, "{file}:{line}: ")?,
            Origin::Flag(flag) => write!(f, "{flag}: ")?,
        }
        match &self.key {
            None => Ok(()),
            Some(key) => write!(f, "{key}: "),
        }
    }
}

/// A number as one would type it.
pub(crate) fn figure(value: f64) -> String {
    if value == 0.0 || (1e-4..1e7).contains(&value.abs()) || !value.is_finite() {
        value.to_string()
    } else {
        format!("{value:e}")
    }
}

/// At most so many names, and how many more there are: "a.nii, b.nii and 4 more".
pub(crate) fn first_of(names: &[impl AsRef<str>], most: usize) -> String {
    let shown = names.iter().take(most).map(AsRef::as_ref);
    let shown = shown.collect::<Vec<&str>>().join(", ");
    match names.len().saturating_sub(most) {
        0 => shown,
        more => format!("{shown} and {more} more"),
    }
}
