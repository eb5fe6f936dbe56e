//! A file's bytes from its beginning on, read as far as they are needed and no further: a header is a few thousand
//! bytes before pixels of any length.
//!
//! Allocations grow with the bytes that arrive, so that no length in a damaged header costs memory.

use std::io::Read;

use crate::scene::volume::parsed::Parsed;

/// Bytes of the first read: most headers are shorter.
const FIRST: u64 = 16 << 10;
/// An upper bound of a header's length. The header of a thousand frames takes a few megabytes.
const MOST: u64 = 256 << 20;

pub struct Stream {
    reader: Box<dyn Read>,
    bytes: Vec<u8>,
    /// The system's error, if it did not return bytes that were requested: nothing is known of them then.
    pub failure: Option<String>,
}

impl Stream {
    pub fn new(reader: impl Read + 'static) -> Stream {
        Stream {
            reader: Box::new(reader),
            bytes: Vec::new(),
            failure: None,
        }
    }

    /// The `count` bytes from `at` on; fewer where the data end.
    pub fn bytes(&mut self, at: u64, count: u64) -> Parsed<&[u8]> {
        let end = at.saturating_add(count);
        let have = self.bytes.len() as u64;
        if end > have {
            if end > MOST {
                return Err(format!(
                    "an element of {count} bytes begins at byte {at} of its header, expected headers \
                     of at most {MOST} bytes"
                ));
            }
            let more = end.max(2 * have).max(FIRST) - have;
            let mut part = self.reader.by_ref().take(more);
            let read = part.read_to_end(&mut self.bytes);
            // The bytes after the wanted ones may be damaged.
            if (self.bytes.len() as u64) < end {
                read.map_err(|e| {
                    let fault = e.to_string();
                    self.failure = e.raw_os_error().map(|_| fault.clone());
                    fault
                })?;
            }
        }
        let have = self.bytes.len() as u64;
        let range = at.min(have) as usize..end.min(have) as usize;
        Ok(&self.bytes[range])
    }

    /// Exactly `count` bytes from `at` on.
    pub fn exactly(&mut self, at: u64, count: u64) -> Parsed<&[u8]> {
        let bytes = self.bytes(at, count)?;
        if bytes.len() as u64 == count {
            Ok(bytes)
        } else {
            Err(format!(
                "ends at byte {}, inside its header: the file is truncated",
                at + bytes.len() as u64
            ))
        }
    }
}
