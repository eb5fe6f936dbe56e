//! Files of metadata, which are JSON.

use std::path::Path;

use serde::Deserialize;

use crate::scene::volume::format::header::first_bytes;
use crate::scene::volume::parsed::Parsed;

/// The longest metadata that is read, in bytes. Those of labels give each of them a colour.
const LONGEST: u64 = 16 << 20;

/// The contents of a metadata file, as far as `T` names them.
pub fn json<T: for<'a> Deserialize<'a>>(path: &Path) -> Parsed<T> {
    let name = path.file_name().unwrap_or_default().to_string_lossy();
    let bytes = first_bytes(path, LONGEST + 1).map_err(|fault| format!("{name}: {fault}"))?;
    if bytes.len() as u64 > LONGEST {
        return Err(format!(
            "{name} is longer than {LONGEST} bytes, expected metadata"
        ));
    }
    let parsed = serde_json::from_slice(&bytes);
    let parsed = parsed.or_else(|error| match with_quoted_numbers(&bytes) {
        Some(plain) => serde_json::from_slice(&plain),
        None => Err(error),
    });
    parsed.map_err(|e| format!("{name}: {e}"))
}

/// JSON cannot express NaN and infinities; Python writes them all the same, and here they become texts, as Zarr has them. `None`
/// where there are none of them.
fn with_quoted_numbers(json: &[u8]) -> Option<Vec<u8>> {
    const BARE: [&[u8]; 3] = [b"-Infinity", b"Infinity", b"NaN"];
    let mut plain = Vec::with_capacity(json.len());
    let (mut is_text, mut has_any) = (false, false);
    let mut rest = json;
    while let [byte, ..] = rest {
        let bare = BARE.iter().find(|bare| !is_text && rest.starts_with(bare));
        let length = match bare {
            Some(bare) => bare.len(),
            None if is_text && *byte == b'\\' => 2,
            None => 1,
        };
        is_text ^= *byte == b'"';
        let (token, after) = rest.split_at(length.min(rest.len()));
        match bare {
            Some(bare) => plain.extend([b"\"", *bare, b"\""].concat()),
            None => plain.extend(token),
        }
        has_any |= bare.is_some();
        rest = after;
    }
    has_any.then_some(plain)
}
