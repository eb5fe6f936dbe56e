//! Headers of text lines, as NRRD and MetaImage have them, and the data files that they name.

use std::collections::HashMap;
use std::path::{Path, PathBuf};
use std::str::FromStr;

use crate::scene::volume::parsed::{Parsed, unexpected};

/// The most bytes of a header of text lines.
pub const TEXT_LIMIT: u64 = 1 << 20;

/// The lines of a text header, each with the offset of the byte after it.
pub fn lines(bytes: &[u8]) -> impl Iterator<Item = (String, usize)> {
    let mut end = 0;
    bytes
        .split_inclusive(|byte| *byte == b'\n')
        .map(move |line| {
            end += line.len();
            (String::from_utf8_lossy(line).trim().to_string(), end)
        })
}

/// The `key: value` lines of a text header.
#[derive(Debug, Default)]
pub struct Fields(HashMap<String, String>);

impl Fields {
    /// Keys are compared without regard to case and spaces ("data file" is "datafile"). Fails for a key with two values.
    pub fn insert(&mut self, key: &str, value: &str) -> Parsed<()> {
        let value = value.trim();
        let kept = self.0.entry(canonical(key)).or_insert_with(|| value.into());
        if kept == value {
            Ok(())
        } else {
            Err(format!(
                "the header has `{}` twice, with different values",
                key.trim()
            ))
        }
    }

    /// The keys that are not known, in small letters, without spaces, and in the order of the alphabet.
    pub fn others(&self, is_known: impl Fn(&str) -> bool) -> Vec<&str> {
        let keys = self.0.keys().map(String::as_str);
        let mut others: Vec<&str> = keys.filter(|key| !is_known(key)).collect();
        others.sort_unstable();
        others
    }

    pub fn get(&self, key: &str) -> Option<&str> {
        self.0.get(&canonical(key)).map(String::as_str)
    }

    pub fn require(&self, key: &str) -> Parsed<&str> {
        self.get(key)
            .ok_or_else(|| format!("the header has no `{key}`"))
    }

    /// One number.
    pub fn number<T: FromStr>(&self, key: &str, kind: &str) -> Parsed<Option<T>> {
        let parse = |value: &str| value.parse().map_err(|_| unexpected(key, value, kind));
        self.get(key).map(parse).transpose()
    }

    /// Exactly `count` numbers, separated by blanks.
    pub fn numbers<T: FromStr>(
        &self,
        key: &str,
        count: usize,
        kind: &str,
    ) -> Parsed<Option<Vec<T>>> {
        let Some(value) = self.get(key) else {
            return Ok(None);
        };
        let numbers: Result<Vec<T>, _> = value.split_whitespace().map(T::from_str).collect();
        let numbers = numbers.ok().filter(|numbers| numbers.len() == count);
        let wrong = || unexpected(key, value, &format!("{count} {kind}"));
        numbers.map(Some).ok_or_else(wrong)
    }

    /// The sizes along `count` axes.
    pub fn sizes(&self, key: &str, count: usize) -> Parsed<Vec<u32>> {
        self.require(key)?;
        let sizes = self.numbers(key, count, "whole numbers from 1 to 4294967295")?;
        Ok(sizes.unwrap_or_default())
    }
}

fn canonical(key: &str) -> String {
    key.to_ascii_lowercase().replace(' ', "")
}

/// The path of a data file named in a header, which lies beside the header.
pub fn beside(header: &Path, name: &str) -> PathBuf {
    header.parent().unwrap_or(Path::new("")).join(name)
}

/// Whether a header names several data files: by a list that follows, or by a pattern and the numbers to put into it, as in
/// "slice%03d.raw 1 9 1". A file that has this name, per cent signs and all, is meant as one file.
pub fn names_several_files(header: &Path, name: &str) -> bool {
    let mut words = name.split_whitespace();
    let first = words.next().unwrap_or_default();
    let numbers = words.rev().take_while(|word| word.parse::<i64>().is_ok());
    let is_conversion = |text: &str| {
        let letter = text.trim_start_matches(|c: char| c.is_ascii_digit());
        letter.starts_with(['d', 'i', 'u'])
    };
    let is_pattern = name.split('%').skip(1).any(is_conversion) && numbers.count() >= 3;
    (first == "LIST" || is_pattern) && !beside(header, name).is_file()
}
