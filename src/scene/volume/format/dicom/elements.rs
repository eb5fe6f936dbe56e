//! Reads DICOM's elements: a tag, a length, a value, nested in sequences of items.
//!
//! Only the elements in [`tags`] are kept. All others, and with them everything that identifies the patient, are
//! skipped by their length and never become a value in this program.
//!
//! The crate `dicom-object` reads all of this too. It allocates an element's stated length before it has read it (4
//! GB for a file of 200 bytes), it does not tell where in the file the pixels are, which is needed for reading them
//! in place, and it brings 25 crates. This file is the part of it that a volume needs.

use crate::scene::volume::parsed::Parsed;

use super::data_set::{DataSet, Value};
use super::stream::Stream;
use super::syntax::Syntax;
use super::tags::{self, Tag};

/// The most levels of nested sequences; real files have four or five.
const MOST_NESTED: u32 = 16;
/// The longest value that is kept. The longest one needed is a table of the frames' offsets.
const LONGEST: u64 = 64 << 20;
/// The length of a value that ends with a delimiter.
const UNDEFINED: u64 = u32::MAX as u64;

/// The place of the pixels.
#[derive(Debug, Clone, Copy)]
pub struct Pixels {
    pub tag: Tag,
    /// Offset of their first byte in the data set's stream.
    pub at: u64,
    /// `None` if they come in fragments.
    pub length: Option<u64>,
    /// Whether they are written as words of 16 bits (OW).
    pub is_words: bool,
}

/// Reads a data set from `at` on, up to its pixels.
pub fn read(stream: &mut Stream, at: u64, syntax: Syntax) -> Parsed<(DataSet, Option<Pixels>)> {
    let mut walk = Walk {
        stream,
        at,
        pixels: None,
    };
    let data_set = walk.data_set(syntax, None, 0)?;
    Ok((data_set, walk.pixels))
}

/// Reads the elements of one group at the beginning, such as a file's meta information, and returns them with their
/// end.
pub fn read_group(stream: &mut Stream, at: u64, group: u16) -> Parsed<(DataSet, u64)> {
    let mut walk = Walk {
        stream,
        at,
        pixels: None,
    };
    let mut data_set = DataSet::default();
    loop {
        let begin = walk.at;
        let next = walk.stream.bytes(begin, 2)?;
        let next = next.first_chunk();
        let found = next.map(|next| Syntax::EXPLICIT.endian.u16(*next));
        if found != Some(group) {
            return Ok((data_set, begin));
        }
        walk.element(&mut data_set, Syntax::EXPLICIT, None, 0)?;
    }
}

struct Walk<'a> {
    stream: &'a mut Stream,
    at: u64,
    pixels: Option<Pixels>,
}

struct Head {
    tag: Tag,
    vr: [u8; 2],
    /// `None` for a value that ends with a delimiter.
    length: Option<u64>,
}

impl Walk<'_> {
    /// Elements up to `end`, or else up to a delimiter or the end of the data.
    fn data_set(&mut self, syntax: Syntax, end: Option<u64>, depth: u32) -> Parsed<DataSet> {
        let mut data_set = DataSet::default();
        loop {
            if end.is_some_and(|end| self.at >= end) {
                return Ok(data_set);
            }
            if depth == 0 && self.stream.bytes(self.at, 1)?.is_empty() {
                // The last element may have been skipped, and not be there as a whole.
                self.stream.exactly(self.at.saturating_sub(1), 1)?;
                return Ok(data_set);
            }
            if !self.element(&mut data_set, syntax, end, depth)? {
                return Ok(data_set);
            }
        }
    }

    /// Reads one element; false if it was the last of this data set.
    fn element(
        &mut self,
        data_set: &mut DataSet,
        syntax: Syntax,
        end: Option<u64>,
        depth: u32,
    ) -> Parsed<bool> {
        let head = self.head(syntax)?;
        if head.tag == tags::ITEM_END || head.tag == tags::SEQUENCE_END {
            return Ok(false);
        }
        if depth == 0 && tags::PIXELS.contains(&head.tag) {
            self.pixels = Some(Pixels {
                tag: head.tag,
                at: self.at,
                length: head.length,
                is_words: &head.vr == b"OW",
            });
            return Ok(false);
        }
        let is_kept = tags::is_kept(head.tag);
        // A value of unknown type and without a length is written without types.
        let inner = match &head.vr {
            b"UN" => Syntax::IMPLICIT,
            _ => syntax,
        };
        match head.length {
            // The pixels of an icon, in fragments.
            None if tags::PIXELS.contains(&head.tag) => self.skip_fragments(syntax)?,
            None => {
                let items = self.items(inner, None, depth)?;
                if is_kept {
                    data_set.elements.push((head.tag, Value::Items(items)));
                }
            }
            Some(length) => {
                let after = self.at.saturating_add(length);
                if end.is_some_and(|end| after > end) {
                    return Err(format!(
                        "an element of {length} bytes at byte {} leaves its sequence: the file is damaged",
                        self.at
                    ));
                }
                if is_kept && tags::is_sequence(head.tag) {
                    let items = self.items(inner, Some(after), depth)?;
                    data_set.elements.push((head.tag, Value::Items(items)));
                } else if is_kept && length <= LONGEST {
                    let bytes = self.stream.exactly(self.at, length)?.to_vec();
                    let value = Value::Plain { bytes, syntax };
                    data_set.elements.push((head.tag, value));
                }
                self.at = after;
            }
        }
        Ok(true)
    }

    fn items(&mut self, syntax: Syntax, end: Option<u64>, depth: u32) -> Parsed<Vec<DataSet>> {
        if depth >= MOST_NESTED {
            return Err(format!(
                "its sequences are nested deeper than {MOST_NESTED}: the file is damaged"
            ));
        }
        let mut items = Vec::new();
        while end.is_none_or(|end| self.at < end) {
            let begin = self.at;
            let head = self.head(syntax)?;
            match head.tag {
                tags::ITEM => {
                    let end = head.length.map(|length| self.at.saturating_add(length));
                    let item = self.data_set(syntax, end, depth + 1)?;
                    items.push(item);
                }
                tags::SEQUENCE_END => break,
                tag => {
                    return Err(format!(
                        "the sequence at byte {begin} holds element {tag}, expected an item: the file \
                         is damaged"
                    ));
                }
            }
        }
        Ok(items)
    }

    fn skip_fragments(&mut self, syntax: Syntax) -> Parsed<()> {
        loop {
            let head = self.head(syntax)?;
            match head.length {
                Some(length) if head.tag == tags::ITEM => self.at = self.at.saturating_add(length),
                _ => return Ok(()),
            }
        }
    }

    fn head(&mut self, syntax: Syntax) -> Parsed<Head> {
        let Syntax {
            is_explicit,
            endian,
        } = syntax;
        let bytes = self.stream.exactly(self.at, 8)?;
        let word = |at: usize| endian.u16([bytes[at], bytes[at + 1]]);
        let tag = Tag(word(0), word(2));
        let vr = [bytes[4], bytes[5]];
        let is_typed = is_explicit && tag.0 != 0xfffe && vr.iter().all(u8::is_ascii_uppercase);
        let (length, size) = if !is_typed {
            (endian.number(&bytes[4..]), 8)
        } else if tags::LONG_TYPES.contains(&&vr) {
            (endian.number(self.stream.exactly(self.at + 8, 4)?), 12)
        } else {
            (endian.number(&bytes[6..]), 8)
        };
        self.at += size;
        Ok(Head {
            tag,
            vr: if is_typed { vr } else { *b"  " },
            length: (length != UNDEFINED).then_some(length),
        })
    }
}
