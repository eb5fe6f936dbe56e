//! Damage to a file, most of it to what its header says.

use fastrand::Rng;

/// Numbers that sizes and offsets trip over.
const NUMBERS: [&str; 14] = [
    "0",
    "-1",
    "1",
    "65536",
    "2147483648",
    "4294967295",
    "4294967296",
    "9223372036854775807",
    "18446744073709551615",
    "1e308",
    "-1e308",
    "1e-320",
    "nan",
    "inf",
];

const BITS: [u32; 8] = [
    0,
    1,
    0x7fff_ffff,
    0x8000_0000,
    0xffff_ffff,
    0x7f80_0000,
    0x7fc0_0000,
    0x0000_7fff,
];

/// A place in the file, more often in its header than elsewhere.
fn place(bytes: &[u8], rng: &mut Rng) -> usize {
    let end = if rng.bool() {
        bytes.len().min(360)
    } else {
        bytes.len()
    };
    rng.usize(..=end.saturating_sub(1))
}

/// The line, or what there is of it, around a place.
fn line(bytes: &[u8], at: usize) -> std::ops::Range<usize> {
    let newline = |byte: &u8| *byte == b'\n';
    let begin = bytes[..at].iter().rposition(newline).map_or(0, |n| n + 1);
    let end = bytes[at..].iter().position(newline);
    begin..end.map_or(bytes.len(), |n| at + n + 1)
}

/// The digits after a place.
fn number(bytes: &[u8], at: usize) -> Option<std::ops::Range<usize>> {
    let begin = at + bytes[at..].iter().position(u8::is_ascii_digit)?;
    let length = bytes[begin..]
        .iter()
        .take_while(|byte| byte.is_ascii_digit())
        .count();
    Some(begin..begin + length)
}

/// Changes a bit, a byte, a number, a line or more of the file, or cuts it.
pub fn mutate(bytes: &mut Vec<u8>, rng: &mut Rng) {
    if bytes.is_empty() {
        return;
    }
    let at = place(bytes, rng);
    let hostile = NUMBERS[rng.usize(..NUMBERS.len())].bytes();
    match rng.u8(..10) {
        0 => bytes[at] ^= 1 << rng.u8(..8),
        1 => bytes[at] = rng.u8(..),
        2 => bytes.truncate(at),
        3 => {
            bytes.splice(at..at, hostile);
        }
        4 | 5 => {
            if let Some(digits) = number(bytes, at) {
                bytes.splice(digits, hostile);
            }
        }
        6 => {
            let line = line(bytes, at);
            bytes.drain(line);
        }
        7 => {
            let line = line(bytes, at);
            let copy = bytes[line.clone()].to_vec();
            bytes.splice(line.end..line.end, copy);
        }
        8 => {
            let bits = BITS[rng.usize(..BITS.len())];
            let even = at & !1;
            let word = if rng.bool() {
                bits.to_le_bytes()
            } else {
                bits.to_be_bytes()
            };
            let end = bytes.len().min(even + 4);
            bytes[even..end].copy_from_slice(&word[..end - even]);
        }
        _ => {
            let end = (at + rng.usize(1..9)).min(bytes.len());
            bytes.drain(at..end);
        }
    }
}
