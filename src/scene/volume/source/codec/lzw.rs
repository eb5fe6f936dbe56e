//! LZW in TIFF's variant: the high bits first, and codes that grow one step early.
//!
//! A code stands for an earlier decoded string and one more byte. Since that byte is the next one decoded, each
//! string lies contiguously in the decoded data, and a table needs only its place.

use crate::scene::volume::parsed::Parsed;

const CLEAR: usize = 256;
const END: usize = 257;
const FIRST: usize = 258;
const MOST_CODES: usize = 1 << 12;
const LEAST_BITS: u32 = 9;

/// Where a code's string begins, and its length.
type Place = (u32, u32);

/// Decodes up to `expected` bytes; fewer if the data end before.
pub fn decode(packed: &[u8], expected: usize) -> Parsed<Vec<u8>> {
    let mut decoded = super::reserved(packed, expected);
    let mut table: Vec<Place> = vec![(0, 0); MOST_CODES];
    let mut codes = Codes::new(packed);
    // The next code to be defined, and the string that was decoded last.
    let (mut next, mut last): (usize, Option<Place>) = (FIRST, None);
    while decoded.len() < expected
        && let Some(code) = codes.next()
    {
        if code == CLEAR {
            (next, last) = (FIRST, None);
            codes.bits = LEAST_BITS;
            continue;
        }
        if code == END {
            break;
        }
        let begin = decoded.len();
        let place =
            |at: usize| u32::try_from(at).map_err(|_| "it is longer than 4 GiB".to_string());
        if let Some((at, length)) = last
            && next < MOST_CODES
        {
            table[next] = (at, length + 1);
            next += 1;
        }
        if code < CLEAR {
            decoded.push(code as u8);
        } else if code < next {
            let (at, length) = table[code];
            let (at, end) = (at as usize, (at + length) as usize);
            // A string that was defined just now ends with its own first byte.
            let known = end.min(begin);
            decoded.extend_from_within(at..known);
            if known < end {
                decoded.push(decoded[at]);
            }
        } else {
            return Err(format!("it has code {code} before that was defined"));
        }
        last = Some((place(begin)?, place(decoded.len() - begin)?));
        if next + 1 >= 1 << codes.bits && codes.bits < MOST_CODES.ilog2() {
            codes.bits += 1;
        }
    }
    decoded.truncate(expected);
    Ok(decoded)
}

/// A sequence of codes of changing width.
struct Codes<'a> {
    rest: &'a [u8],
    /// Bits of the next code.
    bits: u32,
    /// The lowest `count` bits have not been used.
    buffer: u64,
    count: u32,
}

impl Codes<'_> {
    fn new(rest: &[u8]) -> Codes<'_> {
        Codes {
            rest,
            bits: LEAST_BITS,
            buffer: 0,
            count: 0,
        }
    }

    fn next(&mut self) -> Option<usize> {
        if self.count < self.bits {
            self.refill();
        }
        self.count = self.count.checked_sub(self.bits)?;
        Some((self.buffer >> self.count) as usize & ((1 << self.bits) - 1))
    }

    fn refill(&mut self) {
        match self.rest.split_first_chunk() {
            Some((bytes, rest)) => {
                self.buffer = self.buffer << 32 | u64::from(u32::from_be_bytes(*bytes));
                (self.rest, self.count) = (rest, self.count + 32);
            }
            None => {
                for byte in std::mem::take(&mut self.rest) {
                    self.buffer = self.buffer << 8 | u64::from(*byte);
                    self.count += 8;
                }
            }
        }
    }
}
