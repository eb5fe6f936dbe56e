//! The vectors of a NRRD's `space directions`.

use crate::scene::volume::parsed::{Parsed, unexpected};

/// "none (1,0,0) (0,1,0) (0,0,1)": one for each of `count` axes. Where space has time as a fourth coordinate, places are
/// those that do not change with it.
pub fn vectors(text: &str, count: usize) -> Parsed<Vec<Option<[f64; 3]>>> {
    let expected = match count {
        3 => "three vectors (x,y,z)".to_string(),
        _ => format!("`none` or a vector (x,y,z) for each of {count} axes"),
    };
    let all = parsed(text).filter(|vectors| vectors.len() == count);
    all.ok_or_else(|| unexpected("space directions", text, &expected))
}

fn parsed(text: &str) -> Option<Vec<Option<[f64; 3]>>> {
    let mut vectors = Vec::new();
    let mut rest = text.trim();
    while !rest.is_empty() {
        let later = match rest.strip_prefix("none") {
            Some(later) => {
                vectors.push(None);
                later
            }
            None => {
                let (group, later) = rest.strip_prefix('(')?.split_once(')')?;
                vectors.push(vector(group)?);
                later
            }
        };
        rest = later.trim_start();
    }
    Some(vectors)
}

/// The three coordinates in space; `None` within for a direction along time.
fn vector(group: &str) -> Option<Option<[f64; 3]>> {
    let numbers = group.split(',').map(|number| number.trim().parse().ok());
    let numbers: Vec<f64> = numbers.collect::<Option<_>>()?;
    match numbers[..] {
        [x, y, z] | [x, y, z, 0.0] => Some(Some([x, y, z])),
        [0.0, 0.0, 0.0, _] => Some(None),
        _ => None,
    }
}
