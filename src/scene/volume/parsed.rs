//! The result of whatever may go wrong with a file.

/// A fault is a sentence without the file's name: whoever knows the path adds it, once.
pub type Parsed<T> = Result<T, String>;
