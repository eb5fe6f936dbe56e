//! The result of an operation that may find a fault in a file.

use crate::error::{Error, Location};

/// A fault is a sentence without the file's name, which is added once by the code that knows the path.
pub type Parsed<T> = Result<T, String>;

/// The result of an operation that follows the user's settings as well, which may be at fault instead of the file.
pub type Keyed<T> = Result<T, Fault>;

/// A fault of a file, or of what the user has set for it.
#[derive(Debug)]
pub struct Fault {
    /// The setting that is at fault: its key in the scene's `[volume]`.
    pub key: Option<&'static str>,
    pub problem: String,
}

impl Fault {
    pub fn of(key: &'static str, problem: impl Into<String>) -> Fault {
        Fault {
            key: Some(key),
            problem: problem.into(),
        }
    }

    /// The error of the file with this name.
    pub fn in_file(self, name: &str) -> Error {
        let location = Location {
            key: self.key.map(|key| format!("volume.{key}")),
            ..Location::file(name)
        };
        Error::input(location, self.problem)
    }
}

impl<T: Into<String>> From<T> for Fault {
    fn from(problem: T) -> Fault {
        Fault {
            key: None,
            problem: problem.into(),
        }
    }
}

/// "`sizes` is `4 5`, expected …"
pub fn unexpected(key: &str, value: &str, expected: &str) -> String {
    const SHOWN: usize = 80;
    let shown: String = value.chars().take(SHOWN).collect();
    let more = if value.chars().count() > SHOWN {
        "…"
    } else {
        ""
    };
    format!("`{key}` is `{shown}{more}`, expected {expected}")
}
