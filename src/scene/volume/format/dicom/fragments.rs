//! The places of packed frames in a file.
//!
//! Packed pixels come in fragments. A frame is one fragment or several, and a table at the beginning, which may be
//! empty, says where each frame begins. Without the table, a frame begins with each fragment that begins with a
//! codestream's first marker.

use std::io::{BufReader, Read, Seek, SeekFrom};

use crate::scene::volume::parsed::Parsed;

use super::image::Image;

const ITEM: [u8; 4] = [0xfe, 0xff, 0x00, 0xe0];
const JPEG_BEGINS: [u8; 2] = [0xff, 0xd8];
const JPEG_2000_BEGINS: [u8; 2] = [0xff, 0x4f];

/// A fragment's place in the file.
#[derive(Debug, Clone, Copy)]
struct Fragment {
    at: u64,
    length: u64,
    /// Whether it begins like a codestream.
    is_first: bool,
}

/// The frames of a file.
#[derive(Debug)]
pub struct Fragments {
    all: Vec<Fragment>,
    /// Index of the first fragment of each frame.
    firsts: Vec<usize>,
}

impl Fragments {
    pub fn of(image: &Image) -> Parsed<Fragments> {
        let mut file = BufReader::with_capacity(64, image.place.open()?);
        let mut at = image.pixels.at;
        let end = match image.pixels.length {
            Some(length) => at.saturating_add(length).min(image.place.bytes()),
            None => image.place.bytes(),
        };
        let mut table = Vec::new();
        let mut all: Vec<Fragment> = Vec::new();
        let mut is_table = true;
        while at + 8 <= end {
            file.seek(SeekFrom::Start(at)).map_err(|e| e.to_string())?;
            let mut head = [0; 8];
            file.read_exact(&mut head).map_err(|e| e.to_string())?;
            let [.., a, b, c, d] = head;
            let length = u64::from(u32::from_le_bytes([a, b, c, d]));
            at += 8;
            if head[..4] != ITEM {
                break;
            }
            if length > image.place.bytes() - at {
                return Err(format!(
                    "a fragment of its pixels has {length} bytes, and {} are left: the file is truncated",
                    image.place.bytes() - at
                ));
            }
            if is_table {
                let mut bytes = vec![0; length as usize];
                file.read_exact(&mut bytes).map_err(|e| e.to_string())?;
                let entry = |bytes: &[u8; 4]| u64::from(u32::from_le_bytes(*bytes));
                table = bytes.as_chunks().0.iter().map(entry).collect();
                is_table = false;
            } else {
                let mut begin = [0; 2];
                let is_long = length >= 2 && file.read_exact(&mut begin).is_ok();
                all.push(Fragment {
                    at,
                    length,
                    is_first: is_long && [JPEG_BEGINS, JPEG_2000_BEGINS].contains(&begin),
                });
            }
            at += length;
        }
        let firsts = firsts(image, &all, &table)?;
        Ok(Fragments { all, firsts })
    }

    /// All bytes of one frame.
    pub fn read(&self, image: &Image, frame: u32) -> Parsed<Vec<u8>> {
        let frame = frame as usize;
        let missing = || format!("has no frame {}, expected {}", frame + 1, image.frame_count);
        let first = *self.firsts.get(frame).ok_or_else(missing)?;
        let next = self
            .firsts
            .get(frame + 1)
            .copied()
            .unwrap_or(self.all.len());
        let mut packed = Vec::new();
        for fragment in self.all.get(first..next).ok_or_else(missing)? {
            let before = packed.len();
            packed.resize(before + fragment.length as usize, 0);
            image.place.read(fragment.at, &mut packed[before..])?;
        }
        Ok(packed)
    }
}

fn firsts(image: &Image, all: &[Fragment], table: &[u64]) -> Parsed<Vec<usize>> {
    let count = image.frame_count as usize;
    if count == 1 {
        return Ok(vec![0]);
    }
    if all.len() == count {
        return Ok((0..count).collect());
    }
    let tables = [table, &image.offsets];
    if let Some(table) = tables.into_iter().find(|table| table.len() == count) {
        let begin = all.first().map_or(0, |fragment| fragment.at - 8);
        let find = |offset: &u64| {
            let found = all.binary_search_by_key(&offset.saturating_add(begin), |item| item.at - 8);
            found.map_err(|_| format!("no fragment of its pixels begins at byte {offset}"))
        };
        return table.iter().map(find).collect();
    }
    let marked = all
        .iter()
        .enumerate()
        .filter(|(_, fragment)| fragment.is_first);
    let firsts: Vec<usize> = marked.map(|(n, _)| n).collect();
    if firsts.len() == count {
        Ok(firsts)
    } else {
        Err(format!(
            "its pixels are {} fragments, expected {count} frames",
            all.len()
        ))
    }
}
