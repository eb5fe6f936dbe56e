//! The axes of a NRRD: three of them are places, and others count times, or the values of a voxel.
//!
//! `kinds` names what each axis is. Where it does not tell, an axis without a direction in space is no place; and if
//! four are left, neither is the one that is 1 long, or else the slowest.

use super::vectors::vectors;
use crate::scene::volume::format::header::{Fields, unexpected};
use crate::scene::volume::format::several::{Key, Several};
use crate::scene::volume::parsed::Parsed;

/// The axes of a file.
#[derive(Debug)]
pub struct FileAxes {
    /// How many there are.
    pub count: usize,
    /// The numbers of those that are x, y and z.
    pub places: [usize; 3],
    pub dims: [u32; 3],
    /// What the others are.
    pub several: Several,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Kind {
    Place,
    Beside(Key),
}

use Kind::{Beside, Place};

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
        let places = (0..count).filter(|axis| kinds[*axis] == Place);
        let places: Vec<usize> = places.collect();
        let Ok(places) = <[usize; 3]>::try_from(places) else {
            let found = fields.get("kinds").unwrap_or("domain");
            return Err(unexpected("kinds", found, "domain or space for three axes"));
        };
        Ok(FileAxes {
            count,
            places,
            dims: places.map(|axis| sizes[axis]),
            several: several(&kinds, &sizes, places)?,
        })
    }
}

/// What each axis is.
fn kinds(fields: &Fields, sizes: &[u32]) -> Parsed<Vec<Kind>> {
    let mut kinds = stated(fields, sizes.len())?;
    let places = |kinds: &[Kind]| kinds.iter().filter(|kind| **kind == Place).count();
    // Of three axes, time may be the one along which slices follow one another.
    while let (true, Some(time)) = (
        places(&kinds) < 3,
        kinds.iter().position(|kind| *kind == Beside(Key::Time)),
    ) {
        kinds[time] = Place;
    }
    while places(&kinds) > 3 {
        let is_spare = |axis: &usize| kinds[*axis] == Place && sizes[*axis] == 1;
        let spare = (0..sizes.len()).find(is_spare);
        let slowest = kinds.iter().rposition(|kind| *kind == Place);
        if let Some(axis) = spare.or(slowest) {
            kinds[axis] = Beside(Key::Time);
        }
    }
    Ok(kinds)
}

/// What each axis is as far as the file says.
fn stated(fields: &Fields, count: usize) -> Parsed<Vec<Kind>> {
    let mut kinds = vec![Place; count];
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
                (Place, None, 0) => Beside(Key::Channel),
                (Place, None, _) => Beside(Key::Time),
                (stated, ..) => stated,
            };
        }
    }
    Ok(kinds)
}

fn kind(word: &str) -> Kind {
    match word {
        "domain" | "space" | "???" | "none" => Place,
        "time" => Beside(Key::Time),
        // Lists, colours, vectors, matrices.
        _ => Beside(Key::Channel),
    }
}

/// What there is beside places, which must be within all of them or beyond.
fn several(kinds: &[Kind], sizes: &[u32], places: [usize; 3]) -> Parsed<Several> {
    let mut several = Several::default();
    for (axis, (kind, &size)) in kinds.iter().zip(sizes).enumerate() {
        let Beside(key) = *kind else { continue };
        let wrong = |why| Err(format!("`sizes` has {size} for axis {}, {why}", axis + 1));
        let is_told = several.within.iter().chain(&several.beyond);
        let is_told = is_told.map(|(key, _)| key).any(|told| *told == key);
        match size {
            0 => return wrong("expected 1 or more"),
            1 => {}
            _ if is_told => {
                return wrong("expected 1: only one axis of channels and one of times are read");
            }
            _ if axis > places[2] => several.beyond.push((key, size)),
            _ if axis < places[0] && several.within.is_none() => several.within = Some((key, size)),
            _ => return wrong("expected 1: channels and times must be the first axis or the last"),
        }
    }
    Ok(several)
}
