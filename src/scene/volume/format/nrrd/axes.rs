//! The axes of a NRRD: three are spatial, and the others are times or the channels of a voxel.
//!
//! `kinds` names what each axis is. Where four or more axes have `space directions`, one that is not named otherwise and
//! whose direction is `none` is not spatial: the first axis holds channels, any other one times. If fewer than three are
//! spatial then, axes of times count as spatial; of more than three, the surplus counts as times: first axes of length 1,
//! then the slowest.

use super::vectors::vectors;
use crate::scene::volume::format::several::{Key, Several};
use crate::scene::volume::format::text::Fields;
use crate::scene::volume::parsed::{Parsed, unexpected};

/// The axes of a file.
#[derive(Debug)]
pub struct FileAxes {
    /// Number of axes.
    pub count: usize,
    /// The numbers of the axes x, y and z.
    pub spatial: [usize; 3],
    pub dims: [u32; 3],
    /// The other axes.
    pub several: Several,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Kind {
    Spatial,
    Other(Key),
}

use Kind::{Other, Spatial};

impl FileAxes {
    pub fn read(fields: &Fields) -> Parsed<FileAxes> {
        const MOST: usize = 16;
        let stated = fields.require("dimension")?;
        let count = stated.parse().ok();
        let count = count.filter(|count| (3..=MOST).contains(count));
        let expected = "3, or more where channels or times are to be picked";
        let count: usize = count.ok_or_else(|| unexpected("dimension", stated, expected))?;
        let sizes = fields.sizes("sizes", count)?;
        let kinds = kinds(fields, &sizes)?;
        let spatial = (0..count).filter(|axis| kinds[*axis] == Spatial);
        let spatial: Vec<usize> = spatial.collect();
        let Ok(spatial) = <[usize; 3]>::try_from(spatial) else {
            let found = fields.get("kinds").unwrap_or("domain");
            return Err(unexpected("kinds", found, "domain or space for three axes"));
        };
        Ok(FileAxes {
            count,
            spatial,
            dims: spatial.map(|axis| sizes[axis]),
            several: several(&kinds, &sizes, spatial)?,
        })
    }
}

/// What each axis is.
fn kinds(fields: &Fields, sizes: &[u32]) -> Parsed<Vec<Kind>> {
    let mut kinds = stated(fields, sizes.len())?;
    let spatial = |kinds: &[Kind]| kinds.iter().filter(|kind| **kind == Spatial).count();
    // Of three axes, time may be the one along which slices follow one another.
    while let (true, Some(time)) = (
        spatial(&kinds) < 3,
        kinds.iter().position(|kind| *kind == Other(Key::Time)),
    ) {
        kinds[time] = Spatial;
    }
    while spatial(&kinds) > 3 {
        let is_spare = |axis: &usize| kinds[*axis] == Spatial && sizes[*axis] == 1;
        let spare = (0..sizes.len()).find(is_spare);
        let slowest = kinds.iter().rposition(|kind| *kind == Spatial);
        if let Some(axis) = spare.or(slowest) {
            kinds[axis] = Other(Key::Time);
        }
    }
    Ok(kinds)
}

/// What each axis is as far as the file says.
fn stated(fields: &Fields, count: usize) -> Parsed<Vec<Kind>> {
    let mut kinds = vec![Spatial; count];
    if let Some(text) = fields.get("kinds") {
        let words = text.to_lowercase();
        kinds = words.split_whitespace().map(kind).collect();
        if kinds.len() != count {
            let expected = format!("one for each of {count} axes");
            return Err(unexpected("kinds", text, &expected));
        }
    }
    if let (Some(directions), 4..) = (fields.get("space directions"), count) {
        let directions = vectors(directions, count)?;
        for (axis, (kind, direction)) in kinds.iter_mut().zip(directions).enumerate() {
            *kind = match (*kind, direction, axis) {
                // Values that lie side by side are one voxel's.
                (Spatial, None, 0) => Other(Key::Channel),
                (Spatial, None, _) => Other(Key::Time),
                (stated, ..) => stated,
            };
        }
    }
    Ok(kinds)
}

fn kind(word: &str) -> Kind {
    match word {
        "domain" | "space" | "???" | "none" => Spatial,
        "time" => Other(Key::Time),
        // Lists, colours, vectors, matrices.
        _ => Other(Key::Channel),
    }
}

/// The other axes, which must be faster than all spatial ones or slower.
fn several(kinds: &[Kind], sizes: &[u32], spatial: [usize; 3]) -> Parsed<Several> {
    let mut several = Several::default();
    for (axis, (kind, &size)) in kinds.iter().zip(sizes).enumerate() {
        let Other(key) = *kind else { continue };
        let wrong = |why| Err(format!("`sizes` has {size} for axis {}, {why}", axis + 1));
        let is_told = several.within.iter().chain(&several.beyond);
        let is_told = is_told.map(|(key, _)| key).any(|told| *told == key);
        match size {
            0 => return wrong("expected 1 or more"),
            1 => {}
            _ if is_told => {
                return wrong("expected 1: only one axis of channels and one of times are read");
            }
            _ if axis > spatial[2] => several.beyond.push((key, size)),
            _ if axis < spatial[0] && several.within.is_none() => {
                several.within = Some((key, size))
            }
            _ => return wrong("expected 1: channels and times must be the first axis or the last"),
        }
    }
    Ok(several)
}
