//! TIFF's directories: tags with values, as they lie in the file.
//!
//! The crate `tiff` reads these too. It allocates 32 bytes for each number before it has checked whether the file is
//! that long, and decodes pages through one reader, so that each of many threads would need its own, with every
//! directory read again. This file is the part of it that a volume needs.

use std::collections::{BTreeMap, HashSet};

use crate::scene::volume::parsed::{Parsed, unexpected};
use crate::scene::volume::source::watched::WatchedFile;
use crate::scene::volume::voxel_type::Endian;

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[repr(u16)]
pub enum Tag {
    NewSubfileType = 254,
    ImageWidth = 256,
    ImageLength = 257,
    BitsPerSample = 258,
    Compression = 259,
    PhotometricInterpretation = 262,
    FillOrder = 266,
    ImageDescription = 270,
    StripOffsets = 273,
    Orientation = 274,
    SamplesPerPixel = 277,
    RowsPerStrip = 278,
    StripByteCounts = 279,
    XResolution = 282,
    YResolution = 283,
    PlanarConfiguration = 284,
    ResolutionUnit = 296,
    Predictor = 317,
    TileWidth = 322,
    TileLength = 323,
    TileOffsets = 324,
    TileByteCounts = 325,
    SubIfds = 330,
    SampleFormat = 339,
    ImageDepth = 32997,
}

/// The most coarser copies of a page, each of which is usually half as large as the one before.
const MOST_COPIES: u64 = 64;

/// The tags of one page, and the offset of the next page's directory; 0 if there is none.
#[derive(Debug)]
pub struct Directory {
    fields: BTreeMap<u16, Field>,
    next: u64,
    /// The directory's length in the file.
    bytes: u64,
}

#[derive(Debug, Clone, Copy)]
struct Field {
    kind: u16,
    count: u64,
    /// Offset of the values.
    at: u64,
}

impl Field {
    /// The size of one of the field's values.
    fn size(&self) -> Option<u64> {
        match self.kind {
            1 | 2 | 6 | 7 => Some(1),
            3 | 8 => Some(2),
            4 | 9 | 11 | 13 => Some(4),
            5 | 10 | 12 | 16 | 17 | 18 => Some(8),
            _ => None,
        }
    }
}

/// A file's header, from which its directories are found.
pub struct Directories<'a> {
    file: &'a WatchedFile,
    pub endian: Endian,
    /// Whether offsets have 64 bits.
    is_big: bool,
    first: u64,
}

impl<'a> Directories<'a> {
    pub fn new(file: &'a WatchedFile) -> Parsed<Directories<'a>> {
        let none = || "does not start as a TIFF file does, with `II` or `MM`".to_string();
        let start = file.read(0, file.bytes().min(16))?;
        let endian = match start.first_chunk() {
            Some(b"II") => Endian::Little,
            Some(b"MM") => Endian::Big,
            _ => return Err(none()),
        };
        let number = |at: usize, size: usize| {
            let bytes = start.get(at..at + size).ok_or_else(none)?;
            Ok::<u64, String>(endian.number(bytes))
        };
        let (is_big, first) = match number(2, 2)? {
            42 => (false, number(4, 4)?),
            43 if number(4, 2)? == 8 => (true, number(8, 8)?),
            _ => return Err("has neither 42 nor 43 at byte 2, so it is no TIFF file".into()),
        };
        Ok(Directories {
            file,
            endian,
            is_big,
            first,
        })
    }

    /// All pages' directories, one after another. Together they must not be longer than the file, since each has its
    /// own place in it.
    fn pages(&self) -> Parsed<Vec<Directory>> {
        let (mut pages, mut bytes, mut next) = (Vec::new(), 0, self.first);
        let mut known = HashSet::new();
        while next != 0 {
            if !known.insert(next) {
                return Err("its directories go round in a circle: the file is damaged".into());
            }
            let directory = self.read(next)?;
            next = directory.next;
            bytes += directory.bytes;
            pages.push(directory);
            if bytes > self.file.bytes() {
                return Err("its directories overlap: the file is damaged".into());
            }
        }
        if pages.is_empty() {
            Err("has no page".into())
        } else {
            Ok(pages)
        }
    }

    /// The pages in full resolution: previews and coarser copies are marked.
    pub fn full_pages(&self) -> Parsed<Vec<Directory>> {
        let mut full = Vec::new();
        for directory in self.pages()? {
            let kind = self.number(&directory, Tag::NewSubfileType)?;
            if kind.unwrap_or(0) & 1 == 0 {
                full.push(directory);
            }
        }
        Ok(full)
    }

    /// Offsets of the directories of a page's coarser copies.
    pub fn coarser(&self, page: &Directory) -> Parsed<Vec<u64>> {
        let copies = self.first_numbers(page, Tag::SubIfds, MOST_COPIES + 1)?;
        let copies = copies.unwrap_or_default();
        let distinct: HashSet<&u64> = copies.iter().collect();
        if copies.len() as u64 <= MOST_COPIES && distinct.len() == copies.len() {
            Ok(copies)
        } else {
            Err(format!(
                "`SubIfds` names more than {MOST_COPIES} coarser copies of a page, or one of them twice: the file is damaged"
            ))
        }
    }

    /// The directory at an offset of the file.
    pub fn read(&self, at: u64) -> Parsed<Directory> {
        let (head, size, inline) = if self.is_big { (8, 20, 8) } else { (2, 12, 4) };
        let count = self.endian.number(&self.file.read(at, head)?);
        let bytes = count.saturating_mul(size).saturating_add(inline);
        let entries = self.file.read(at + head, bytes)?;
        let (entries, next) = entries.split_at(entries.len() - inline as usize);
        let mut fields = BTreeMap::new();
        for (n, entry) in entries.chunks_exact(size as usize).enumerate() {
            let [tag, kind] = [0, 2].map(|at| self.endian.number(&entry[at..at + 2]) as u16);
            let value = entry.len() - inline as usize;
            let mut field = Field {
                kind,
                count: self.endian.number(&entry[4..value]),
                at: at + head + n as u64 * size + value as u64,
            };
            let Some(size) = field.size() else {
                continue;
            };
            if field.count.saturating_mul(size) > inline {
                field.at = self.endian.number(&entry[value..]);
            }
            fields.entry(tag).or_insert(field);
        }
        Ok(Directory {
            fields,
            next: self.endian.number(next),
            bytes: head + bytes,
        })
    }

    /// Whole numbers; `None` if there is no such tag.
    pub fn numbers(&self, directory: &Directory, tag: Tag) -> Parsed<Option<Vec<u64>>> {
        self.first_numbers(directory, tag, u64::MAX)
    }

    /// The first `most` of them. Many directories can share one long list, so none is read further than is needed.
    pub fn first_numbers(
        &self,
        directory: &Directory,
        tag: Tag,
        most: u64,
    ) -> Parsed<Option<Vec<u64>>> {
        let Some(mut field) = directory.fields.get(&(tag as u16)).copied() else {
            return Ok(None);
        };
        field.count = field.count.min(most);
        let size = match field.kind {
            1 | 3 | 4 | 13 | 16 | 18 => field.size().unwrap_or(1),
            kind => return Err(format!("`{tag:?}` has type {kind}, expected whole numbers")),
        };
        let bytes = self.value(&field, tag, size)?;
        let numbers = bytes.chunks_exact(size as usize);
        Ok(Some(numbers.map(|n| self.endian.number(n)).collect()))
    }

    /// One whole number.
    pub fn number(&self, directory: &Directory, tag: Tag) -> Parsed<Option<u64>> {
        let numbers = self.first_numbers(directory, tag, 1)?;
        Ok(numbers.and_then(|numbers| numbers.first().copied()))
    }

    pub fn require(&self, directory: &Directory, tag: Tag) -> Parsed<u64> {
        let number = self.number(directory, tag)?;
        number.ok_or_else(|| format!("has no `{tag:?}`"))
    }

    /// The pixels of a page along x and y; nothing else of the page need be readable.
    pub fn size(&self, directory: &Directory) -> Parsed<[u32; 2]> {
        self.sides(directory, [Tag::ImageWidth, Tag::ImageLength])
    }

    /// Two lengths in pixels.
    pub fn sides(&self, directory: &Directory, [x, y]: [Tag; 2]) -> Parsed<[u32; 2]> {
        let side = |tag| within(tag, self.require(directory, tag)?, u32::MAX);
        Ok([side(x)?, side(y)?])
    }

    /// A fraction; `None` if there is none, or if it is no number above 0.
    pub fn fraction(&self, directory: &Directory, tag: Tag) -> Parsed<Option<f64>> {
        let field = directory.fields.get(&(tag as u16));
        let Some(field) = field.filter(|field| field.kind == 5 && field.count == 1) else {
            return Ok(None);
        };
        let bytes = self.value(field, tag, 8)?;
        let [above, below] = [0, 4].map(|at| self.endian.number(&bytes[at..at + 4]) as f64);
        Ok(Some(above / below).filter(|fraction| fraction.is_normal()))
    }

    /// Text up to its terminator; "" if there is none.
    pub fn text(&self, directory: &Directory, tag: Tag) -> Parsed<String> {
        let field = directory.fields.get(&(tag as u16));
        let Some(field) = field.filter(|field| matches!(field.kind, 1 | 2 | 7)) else {
            return Ok(String::new());
        };
        let mut bytes = self.value(field, tag, 1)?;
        bytes.truncate(
            bytes
                .iter()
                .position(|byte| *byte == 0)
                .unwrap_or(bytes.len()),
        );
        Ok(match String::from_utf8(bytes) {
            Ok(text) => text,
            // Older programs write µ as one byte.
            Err(other) => other
                .as_bytes()
                .iter()
                .map(|byte| char::from(*byte))
                .collect(),
        })
    }

    fn value(&self, field: &Field, tag: Tag, size: u64) -> Parsed<Vec<u8>> {
        let bytes = field.count.saturating_mul(size);
        let read = self.file.read(field.at, bytes);
        read.map_err(|fault| format!("`{tag:?}`: {fault}"))
    }
}

/// A tag's value, which must be from 1 to `most`.
pub fn within(tag: Tag, value: u64, most: u32) -> Parsed<u32> {
    let found = u32::try_from(value).ok();
    found
        .filter(|found| (1..=most).contains(found))
        .ok_or_else(|| {
            let expected = format!("a whole number from 1 to {most}");
            unexpected(&format!("{tag:?}"), &value.to_string(), &expected)
        })
}
