//! The description that tifffile for Python writes: the array's shape, in JSON. Where it says that the file is truncated,
//! only the first page has a directory, and the pixels of all lie one after another.
//! <https://github.com/cgohlke/tifffile>

use serde::Deserialize;

use super::page::Layout;

#[derive(Deserialize)]
struct Shaped {
    shape: Vec<u64>,
    #[serde(default)]
    truncated: bool,
}

/// The number of pages that lie behind the first one's directory; 1 if the description does not say.
pub fn images(description: &str, layout: &Layout) -> u64 {
    let shaped = serde_json::from_str(description).ok();
    let Some(Shaped { shape, .. }) = shaped.filter(|shaped: &Shaped| shaped.truncated) else {
        return 1;
    };
    let mut values: u64 = shape.into_iter().fold(1, u64::saturating_mul);
    for size in [layout.size[0], layout.size[1], layout.samples] {
        values /= u64::from(size).max(1);
    }
    values.max(1)
}
