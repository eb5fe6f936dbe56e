//! BloscLZ, Blosc's own codec: <https://github.com/Blosc/c-blosc/blob/main/blosc/blosclz.c>.
//!
//! A control byte below 32 is followed by literal bytes, one more than its value. Any other gives, in its upper three
//! bits, the length of a match, and with its lower five and the bytes that follow, its distance.

use crate::scene::volume::parsed::Parsed;

/// Distances up to this one take 13 bits.
const NEAR: usize = 8191;

/// Decodes all of `packed`, up to `expected` bytes.
pub fn decode(packed: &[u8], expected: usize) -> Parsed<Vec<u8>> {
    let mut decoded = super::reserved(packed, expected);
    let mut rest = packed;
    // The first byte has the format's version in its upper bits, and is never a match.
    let mut version = 31;
    while let Ok(code) = next(&mut rest) {
        let code = code & version;
        version = 255;
        if code < 32 {
            let bytes = rest.get(..code + 1);
            let bytes = bytes.ok_or("it ends within bytes that are not compressed")?;
            check_room(&decoded, bytes.len(), expected)?;
            decoded.extend_from_slice(bytes);
            rest = &rest[bytes.len()..];
            continue;
        }
        let mut length = (code >> 5) - 1;
        if length == 6 {
            loop {
                let more = next(&mut rest)?;
                length += more;
                if more != 255 {
                    break;
                }
            }
        }
        let mut distance = ((code & 31) << 8) + next(&mut rest)?;
        if distance == NEAR {
            distance += next(&mut rest)? << 8;
            distance += next(&mut rest)?;
        }
        check_room(&decoded, length + 3, expected)?;
        repeat(&mut decoded, distance + 1, length + 3)?;
    }
    Ok(decoded)
}

fn next(rest: &mut &[u8]) -> Parsed<usize> {
    let (byte, later) = rest.split_first().ok_or("it ends within a match")?;
    *rest = later;
    Ok(usize::from(*byte))
}

fn check_room(decoded: &[u8], more: usize, expected: usize) -> Parsed<()> {
    if decoded.len() + more <= expected {
        Ok(())
    } else {
        Err("it is longer than its header says".into())
    }
}

/// Appends `length` bytes from `distance` back on; the match may overlap with what it appends.
fn repeat(decoded: &mut Vec<u8>, distance: usize, length: usize) -> Parsed<()> {
    let begin = decoded
        .len()
        .checked_sub(distance)
        .ok_or("a match begins before its first byte")?;
    let mut copied = 0;
    while copied < length {
        let run = (length - copied).min(decoded.len() - begin - copied);
        decoded.extend_from_within(begin + copied..begin + copied + run);
        copied += run;
    }
    Ok(())
}
