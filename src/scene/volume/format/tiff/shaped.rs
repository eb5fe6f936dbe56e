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

impl Shaped {
    fn of(description: &str) -> Option<Shaped> {
        serde_json::from_str(description).ok()
    }
}

/// The number of pages that lie behind the first one's directory; 1 if the description does not say.
pub fn images(description: &str, layout: &Layout) -> u64 {
    let truncated = Shaped::of(description).filter(|shaped| shaped.truncated);
    let Some(Shaped { shape, .. }) = truncated else {
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
    let shaped = Shaped::of(description);
    let Some(outer) = shaped.and_then(|shaped| outer(&shaped, pages)) else {
        return meaning;
    };
    let Some(Axes { axes, guessed }) = axes(&outer) else {
        let lengths: Vec<String> = outer.iter().map(|(_, length)| length.to_string()).collect();
        meaning.notes.push(format!(
            "the file does not say what the axes of its {} pages are: all are taken as slices",
            lengths.join(" × ")
        ));
        return meaning;
    };
    // The only axis of a stack needs no name.
    if outer.len() > 1 {
        let told = guessed.iter().map(|(axis, length)| {
            let taken = match axis {
                Axis::Time => "time",
                _ => "z",
            };
            format!(
                "the file does not say what its axis of {length} pages is: it is taken as {taken}"
            )
        });
        meaning.notes.extend(told);
    }
    meaning.along(&axes)
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

/// The axes of pages with their lengths, the outermost first, and those among them whose letters do not say what they are.
struct Axes {
    axes: Vec<(Axis, usize)>,
    guessed: Vec<(Axis, usize)>,
}

/// What the axes are; `None` if that cannot be guessed. Of axes without a meaning the last is z and the one before it time, as
/// far as no other axis is.
fn axes(outer: &[(char, usize)]) -> Option<Axes> {
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
    let (mut axes, mut guessed) = (Vec::new(), Vec::new());
    for (letter, length) in outer.iter().rev() {
        let axis = match named(*letter) {
            Some(axis) => axis,
            None => {
                let axis = left.pop()?;
                guessed.insert(0, (axis, *length));
                axis
            }
        };
        if axes.iter().any(|(known, _)| *known == axis) {
            return None;
        }
        axes.insert(0, (axis, *length));
    }
    Some(Axes { axes, guessed })
}
