//! Where each key of a scene was written: the line of a file, or a flag.
//!
//! An error about a key names that location without any code having to pass it along.

use std::collections::BTreeMap;
use std::fmt::Display;
use std::ops::Range;
use std::path::{Path, PathBuf};

use toml::de::{DeTable, DeValue};

use crate::error::{Error, Location, Origin};

/// Where each key of a scene was written.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Origins {
    /// The file's name, which stands for the whole scene.
    pub(super) name: String,
    /// The folder at which relative paths start.
    pub(super) folder: PathBuf,
    /// The origin of each dotted key, such as `light.0.direction`.
    pub(super) places: BTreeMap<String, Origin>,
}

impl Origins {
    /// An input error at a key: its file and line, or its flag, and the key.
    pub fn error(&self, key: &str, problem: impl Display) -> Error {
        Error::input(self.location(key).with_key(key), problem.to_string())
    }

    /// A note about a key, which is no error.
    pub fn sentence(&self, key: &str, problem: impl Display) -> String {
        format!("{}{problem}", self.location(key).with_key(key))
    }

    /// A path as written in the scene, relative to the current directory.
    pub fn path(&self, written: &Path) -> PathBuf {
        self.folder.join(written)
    }

    /// The origin of a key, or of its table if the key was not written.
    fn location(&self, key: &str) -> Location {
        match self.places.get(key) {
            Some(origin) => origin.clone().into(),
            None => match key.rsplit_once('.') {
                Some((table, _)) => self.location(table),
                None => Location::file(&self.name),
            },
        }
    }

    /// Records the line of each key of a table, and of all that is inside.
    pub(super) fn record_lines(&mut self, lines: &Lines, prefix: &str, table: &DeTable) {
        for (key, value) in table {
            let path = join(prefix, key.get_ref());
            self.record(lines, path, key.span().start, value.get_ref());
        }
    }

    fn record(&mut self, lines: &Lines, path: String, at: usize, value: &DeValue) {
        match value {
            DeValue::Table(table) => self.record_lines(lines, &path, table),
            DeValue::Array(items) => {
                for (i, item) in items.iter().enumerate() {
                    let path = join(&path, &i.to_string());
                    self.record(lines, path, item.span().start, item.get_ref());
                }
            }
            _ => {}
        }
        let file = self.name.clone();
        let line = lines.line_at(at);
        self.places.insert(path, Origin::Line { file, line });
    }
}

fn join(prefix: &str, key: &str) -> String {
    match prefix {
        "" => key.to_string(),
        _ => format!("{prefix}.{key}"),
    }
}

/// The dotted key of which the second of two names stands at `second`, and the line of the first.
pub(super) fn first_of_two(text: &str, second: Range<usize>) -> Option<(String, usize)> {
    // Under a name of its own, the second shows in which table both are.
    const OTHER: &str = "the second of two";
    let name = text.get(second.clone())?.trim_matches(['"', '\'']);
    let renamed = format!(
        "{}\"{OTHER}\"{}",
        &text[..second.start],
        &text[second.end..]
    );
    let (table, _) = DeTable::parse_recoverable(&renamed);
    let mut origins = Origins::default();
    origins.record_lines(&Lines::of(&renamed), "", table.get_ref());
    let mut keys = origins.places.keys();
    let key = keys.find_map(|key| key.strip_suffix(OTHER))?.to_string() + name;
    match origins.places.get(&key) {
        Some(Origin::Line { line, .. }) => Some((key, *line)),
        _ => None,
    }
}

/// Where the lines of a text end.
pub(super) struct Lines(Vec<usize>);

impl Lines {
    pub(super) fn of(text: &str) -> Lines {
        Lines(text.match_indices('\n').map(|(end, _)| end).collect())
    }

    /// The line, counted from 1, of the byte at `at`.
    pub(super) fn line_at(&self, at: usize) -> usize {
        self.0.partition_point(|&end| end < at) + 1
    }
}
