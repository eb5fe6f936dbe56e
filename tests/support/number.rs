//! Numbers in the JSON that the program writes.

use serde_json::Value;

/// Fails where there is none: `None` is less than any number, so a comparison of options would hold for a key that is missing.
#[track_caller]
pub fn number(value: &Value) -> f64 {
    value
        .as_f64()
        .unwrap_or_else(|| panic!("{value} is no number"))
}
