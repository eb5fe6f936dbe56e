//! The description that tifffile for Python writes: the array's shape, and the letters of its axes, in JSON. Where it says that
//! the file is truncated, only the first page has a directory, and the pixels of all lie one after another.
//! <https://github.com/cgohlke/tifffile>

use serde::Deserialize;

use super::meaning::{Axis, Meaning};
use super::page::Layout;

#[derive(Deserialize)]
struct Shaped {
    shape: Vec<u64>,
    axes: Option<String>,
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

/// The axes along which the pages lie; all of them are slices where the description does not fit them.
pub fn meaning(description: &str, pages: usize, samples: u32) -> Meaning {
    let mut meaning = Meaning::stack(pages, samples);
    let Some(outer) = serde_json::from_str(description)
        .ok()
        .and_then(|shaped| outer(&shaped, pages))
    else {
        return meaning;
    };
    let lengths: Vec<String> = outer.iter().map(|(_, length)| length.to_string()).collect();
    let lengths = lengths.join(" × ");
    match axes(&outer) {
        Some((axes, are_named)) => {
            let unnamed = format!(
                "the file names no axes of its {lengths} pages: the last is taken as z, and the one before as time"
            );
            meaning.notes.extend((!are_named).then_some(unnamed));
            meaning.along(&axes)
        }
        None => {
            meaning.notes.push(format!(
                "the file has {lengths} pages, which are more axes than time, channel and z: all are taken as slices"
            ));
            meaning
        }
    }
}

/// The letters and lengths of the axes along which the pages lie, without those that are 1 long. Where no letters are stated,
/// each is that of an axis without a meaning.
fn outer(shaped: &Shaped, pages: usize) -> Option<Vec<(char, usize)>> {
    const UNNAMED: char = 'Q';
    let lengths = shaped.shape.iter().map(|length| usize::try_from(*length));
    let lengths: Vec<usize> = lengths.collect::<Result<_, _>>().ok()?;
    let product = |axes: &[(char, usize)]| {
        let mut lengths = axes.iter().map(|(_, length)| *length);
        lengths.try_fold(1, usize::checked_mul)
    };
    let letters: Option<Vec<char>> = shaped.axes.as_ref().map(|axes| axes.chars().collect());
    let mut axes: Vec<(char, usize)> = match letters.filter(|all| all.len() == lengths.len()) {
        Some(letters) => {
            let all = letters.into_iter().zip(lengths);
            all.filter(|(letter, _)| !"YXS".contains(*letter)).collect()
        }
        None => {
            let all: Vec<_> = lengths
                .into_iter()
                .map(|length| (UNNAMED, length))
                .collect();
            let count = (0..all.len()).find(|count| product(&all[..*count]) == Some(pages))?;
            all[..count].to_vec()
        }
    };
    axes.retain(|(_, length)| *length != 1);
    (product(&axes) == Some(pages)).then_some(axes)
}

/// What the axes are, and whether their letters say so; `None` for more of them than pages can have.
fn axes(outer: &[(char, usize)]) -> Option<(Vec<(Axis, usize)>, bool)> {
    let named = |letter: char| match letter {
        'Z' => Some(Axis::Slice),
        'T' => Some(Axis::Time),
        'C' => Some(Axis::Channel),
        _ => None,
    };
    let mut left = vec![Axis::Time, Axis::Slice];
    left.retain(|axis| {
        outer
            .iter()
            .all(|(letter, _)| named(*letter) != Some(*axis))
    });
    let mut are_named = true;
    let mut axes = Vec::new();
    for (letter, length) in outer.iter().rev() {
        let axis = named(*letter).or_else(|| {
            are_named &= outer.len() == 1;
            left.pop()
        })?;
        if axes.iter().any(|(known, _)| *known == axis) {
            return None;
        }
        axes.insert(0, (axis, *length));
    }
    Some((axes, are_named))
}
