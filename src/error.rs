//! What can go wrong, sorted by whom it concerns: each kind has its exit status.

use std::path::Path;

/// Exit status after Ctrl-C with the outputs written.
pub const INTERRUPTED_STATUS: u8 = 130;
/// Exit status after SIGTERM with the outputs written.
pub const TERMINATED_STATUS: u8 = 143;

/// Exit status where a device does not work.
pub const DEVICE_STATUS: u8 = 5;

pub type Result<T, E = Error> = std::result::Result<T, E>;

/// Every message is one clear sentence that names the file, key or flag, what was found and what
/// was expected.
#[derive(Debug, thiserror::Error)]
pub enum Error {
    /// Wrong flags or arguments.
    #[error("{0}")]
    Usage(String),
    /// A file, a scene or a value in it cannot be used.
    #[error("{0}")]
    Input(String),
    /// Out of memory, or over the budget.
    #[error("{0}")]
    Memory(String),
    /// No usable Vulkan device, or it was lost.
    #[error("{0}")]
    Device(String),
    /// Ctrl-C or SIGTERM before there was anything to write.
    #[error("interrupted before the first sample of every pixel was done: nothing was written")]
    Interrupted,
}

impl Error {
    /// The process's exit status.
    pub fn exit_status(&self) -> u8 {
        match self {
            Error::Usage(_) => 2,
            Error::Input(_) => 3,
            Error::Memory(_) => 4,
            Error::Device(_) => DEVICE_STATUS,
            Error::Interrupted => INTERRUPTED_STATUS,
        }
    }

    pub fn input(message: impl Into<String>) -> Error {
        Error::Input(message.into())
    }

    /// A file that could not be read or written.
    pub fn io(path: &Path, error: std::io::Error) -> Error {
        Error::Input(format!("{}: {error}", path.display()))
    }
}
