//! The result of an operation that may find a fault in a file.

/// A fault is a sentence without the file's name, which is added once by the code that knows the path.
pub type Parsed<T> = Result<T, String>;
