//! How frames become a grid of voxels: their order, and the steps where they do not form a grid.
//!
//! The place of a slice is determined by its position and its orientation alone. Numbers of instances, names of files
//! and "slice locations" are often wrong. Slices are put in the order of their places along the normal of their
//! planes, which makes rows, columns and slices right-handed axes whichever way the scanner went.
//!
//! A grid has slices at equal distances, one straight behind the other. Slices at other distances are interpolated
//! linearly between their neighbours; those of a tilted gantry, each a bit further down than the one before, are
//! shifted back by interpolating between rows, on more rows than each has. Both are done when voxels are read; here
//! the steps are only planned.

use std::collections::HashSet;
use std::hash::Hash;

use glam::DVec3;

use crate::scene::volume::orientation::{Axes, Coordinates, Orientation, SHEAR, check_right_angle};
use crate::scene::volume::parsed::Parsed;

use super::frame::{Frame, Plane, unit};
use super::group::{At, Group, frame};
use super::image::Image;
use super::slices::{EXACT, EvenSlices, MOST_INVENTED, Slice, median};

/// Voxels by which the last slice of an upright stack may lie beside the first: positions are rounded.
const STRAIGHT: f64 = 0.1;
/// The most voxels by which a slice may lie beside the line through the others.
const ASTRAY: f64 = 0.5;

/// Distances between slices that may be between two parts of one volume; those of other regions are farther.
const MOST_APART: f64 = 3.0;

/// The recipe for a volume.
#[derive(Debug)]
pub struct Stack {
    pub dims: [u32; 3],
    pub spacing: [f64; 3],
    pub orientation: Orientation,
    /// One frame for each place, in order.
    pub frames: Vec<At>,
    /// The rows by which each of `frames` lies below the volume's first row; each ≥ 0.
    pub shifts: Vec<f64>,
    pub slices: Vec<Slice>,
    /// Frames that lie where one of `frames` lies.
    pub duplicates: Vec<(At, At)>,
    /// A sentence about missing slices.
    pub gaps: Option<String>,
    /// A sentence about a size of pixels that is not stated.
    pub guess: Option<String>,
    /// The steps that make a grid, one sentence each.
    pub notes: Vec<String>,
}

impl Stack {
    pub fn is_sheared(&self) -> bool {
        self.shifts.iter().any(|shift| *shift != 0.0)
    }

    /// The images that it is made of, among all those of a folder. Its frames count these from then on.
    pub fn own_images(&mut self, all: Vec<Image>) -> Vec<Image> {
        let duplicates = self.duplicates.iter_mut().flat_map(|(a, b)| [a, b]);
        let mut frames: Vec<&mut At> = self.frames.iter_mut().chain(duplicates).collect();
        let mut numbers: Vec<Option<usize>> = vec![None; all.len()];
        for at in &frames {
            numbers[at.image] = Some(0);
        }
        for (n, number) in numbers.iter_mut().flatten().enumerate() {
            *number = n;
        }
        for at in &mut frames {
            at.image = numbers[at.image].unwrap_or_default();
        }
        let numbered = all.into_iter().zip(numbers);
        numbered
            .filter_map(|(image, number)| number.map(|_| image))
            .collect()
    }

    /// A picture that does not say where it lies.
    fn of_one_picture(
        picture: At,
        dims: [u32; 3],
        spacing: [f64; 3],
        guess: Option<String>,
    ) -> Stack {
        let notes = vec![
            "the file does not say where its picture lies in the patient: several such files cannot be put in order, unless \
             they are converted to a TIFF stack"
                .into(),
        ];
        Stack {
            dims,
            spacing,
            orientation: Orientation::UNKNOWN,
            frames: vec![picture],
            shifts: vec![0.0],
            slices: vec![Slice::exact(0)],
            duplicates: Vec::new(),
            gaps: None,
            guess,
            notes,
        }
    }

    pub fn new(images: &[Image], group: &Group) -> Parsed<Stack> {
        let first = group.frames[0];
        let image = &images[first.image];
        let mut notes = Vec::new();
        let pixel_spacing = frame(images, first).pixel_spacing;
        let guess = pixel_spacing.is_none().then(|| {
            "the size of its pixels is not known and taken as 1 mm; if that is wrong, set volume.spacing".to_string()
        });
        let [between_rows, between_columns] = pixel_spacing.unwrap_or([1.0; 2]);
        let thickness = frame(images, first).thickness.unwrap_or(1.0);
        let Some(plane) = frame(images, first).plane else {
            let dims = [image.columns, image.rows, 1];
            let spacing = [between_columns, between_rows, thickness];
            return Ok(Stack::of_one_picture(first, dims, spacing, guess));
        };
        let placed = Placed::in_order(images, group, plane);
        let distances = placed.distances();
        let thick = placed.frames.iter().map(|at| frame(images, *at).thickness);
        let thick: Vec<Option<f64>> = thick.collect();
        let even = EvenSlices::of(&placed.places, &distances, &thick, &mut notes)?;
        let shifts = placed.shifts(images, between_columns, between_rows, &mut notes)?;
        let more_rows = more_rows(&shifts, image.rows)?;
        let spacing = [between_columns, between_rows, even.spacing];
        let orientation = placed.orientation(plane, spacing)?;
        notes.extend(told_duplicates(placed.duplicates.len()));
        Ok(Stack {
            dims: [
                image.columns,
                image.rows.saturating_add(more_rows),
                even.slices.len() as u32,
            ],
            spacing,
            orientation,
            frames: placed.frames,
            shifts,
            slices: even.slices,
            duplicates: placed.duplicates,
            gaps: even.gaps,
            guess,
            notes,
        })
    }
}

/// The rows that a volume needs besides those of its slices, which are shifted down by so many.
fn more_rows(shifts: &[f64], rows: u32) -> Parsed<u32> {
    let lowest = shifts.iter().copied().fold(0.0, f64::max);
    let more = (lowest - EXACT).ceil().max(0.0);
    if more > MOST_INVENTED * f64::from(rows) {
        return Err(format!(
            "its slices are shifted by up to {lowest:.0} rows, expected slices one behind the other"
        ));
    }
    Ok(more as u32)
}

/// What is said of slices that lie where others lie.
fn told_duplicates(count: usize) -> Option<String> {
    match count {
        0 => None,
        1 => Some(
            "1 slice lies where another lies, and is left out if it holds the same pixels".into(),
        ),
        _ => Some(format!(
            "{count} slices lie where others lie, and are left out if they hold the same pixels"
        )),
    }
}

/// Whether frames that `part` tells apart are one stack: each part begins where another ends, or, if they may take turns,
/// together they have slices at equal distances. Repetitions overlap.
pub fn is_continued<'a, P: Eq + Hash>(
    images: &'a [Image],
    group: &Group,
    part: impl Fn(&'a Frame) -> P,
    may_take_turns: bool,
) -> bool {
    let Some(plane) = frame(images, group.frames[0]).plane else {
        return false;
    };
    let part = |at: &At| part(frame(images, *at));
    let parts: HashSet<P> = group.frames.iter().map(part).collect();
    let placed = Placed::in_order(images, group, plane);
    let distances = placed.distances();
    let usual = median(&distances).unwrap_or(0.0);
    let mut duplicates = placed.duplicates.iter();
    let is_repeated = duplicates.any(|(a, b)| part(a) != part(b));
    let pairs = placed.frames.windows(2).zip(&distances);
    let borders = pairs.filter(|(pair, _)| part(&pair[0]) != part(&pair[1]));
    let borders: Vec<f64> = borders.map(|(_, distance)| *distance).collect();
    let is_in_turn = borders.len() + 1 == parts.len();
    let is_near = borders
        .iter()
        .all(|distance| *distance <= MOST_APART * usual);
    let is_one = is_in_turn && is_near || may_take_turns && placed.is_even();
    !is_repeated && is_one && Stack::new(images, group).is_ok()
}

/// Whether a group has one slice at each place, and its places are at equal distances.
pub fn is_even(images: &[Image], group: &Group) -> bool {
    let plane = frame(images, group.frames[0]).plane;
    plane.is_some_and(|plane| {
        let placed = Placed::in_order(images, group, plane);
        placed.duplicates.is_empty() && placed.is_even() && Stack::new(images, group).is_ok()
    })
}

/// The frames of a group at each place along the normal; `None` for frames whose place is not known.
pub fn at_each_place(images: &[Image], group: &Group) -> Option<Vec<Vec<At>>> {
    let plane = frame(images, group.frames[0]).plane?;
    let placed = Placed::in_order(images, group, plane);
    let mut places: Vec<Vec<At>> = Vec::new();
    let mut duplicates = placed.duplicates.iter().peekable();
    for first in &placed.frames {
        let is_here = |(one, _): &&(At, At)| (one.image, one.frame) == (first.image, first.frame);
        let mut here = vec![*first];
        while let Some((_, other)) = duplicates.next_if(is_here) {
            here.push(*other);
        }
        places.push(here);
    }
    Some(places)
}

/// Frames in the order of their places along the normal, one for each place.
struct Placed {
    frames: Vec<At>,
    planes: Vec<Plane>,
    /// Millimetres along the normal, ascending.
    places: Vec<f64>,
    normal: DVec3,
    duplicates: Vec<(At, At)>,
}

impl Placed {
    fn in_order(images: &[Image], group: &Group, plane: Plane) -> Placed {
        // Directions of one group differ by no more than rounding, so that there is a normal.
        let normal = unit(plane.along[0].cross(plane.along[1])).unwrap_or(DVec3::Z);
        let plane_of = |at: &At| frame(images, *at).plane.unwrap_or(plane);
        let place = |at: &At| normal.dot(plane_of(at).position);
        let mut all: Vec<(f64, At)> = group.frames.iter().map(|at| (place(at), *at)).collect();
        all.sort_by(|a, b| a.0.total_cmp(&b.0));
        let rounding = rounding(images, group);
        let near = rounding.max(EXACT * usual_distance(&all, rounding));
        let mut placed = Placed {
            frames: Vec::new(),
            planes: Vec::new(),
            places: Vec::new(),
            normal,
            duplicates: Vec::new(),
        };
        for (place, at) in all {
            match (placed.places.last(), placed.frames.last()) {
                (Some(last), Some(duplicate)) if place - last <= near => {
                    placed.duplicates.push((*duplicate, at));
                }
                _ => {
                    placed.frames.push(at);
                    placed.planes.push(plane_of(&at));
                    placed.places.push(place);
                }
            }
        }
        placed
    }

    fn distances(&self) -> Vec<f64> {
        self.places
            .windows(2)
            .map(|pair| pair[1] - pair[0])
            .collect()
    }

    fn is_even(&self) -> bool {
        let distances = self.distances();
        let usual = median(&distances).unwrap_or(0.0);
        let is_usual = |distance: &f64| (distance - usual).abs() <= EXACT * usual;
        distances.iter().all(is_usual)
    }

    /// `plane` is that of a slice, and `spacing` that of the voxels.
    fn orientation(&self, plane: Plane, spacing: [f64; 3]) -> Parsed<Orientation> {
        let [row, column] = plane.along;
        let [between_columns, between_rows, between_slices] = spacing;
        let steps = [
            between_columns * row,
            between_rows * column,
            between_slices * self.normal,
        ];
        let coordinates = if plane.is_in_patient {
            Coordinates::Anatomical(Axes::LPS)
        } else {
            Coordinates::RightHanded
        };
        let (_, orientation) = Orientation::from_steps(steps.map(Into::into), coordinates)?;
        Ok(orientation)
    }

    /// The rows by which each slice lies below the volume's first row. Nothing is shifted along rows: no gantry tilts
    /// in that direction.
    fn shifts(
        &self,
        images: &[Image],
        between_columns: f64,
        between_rows: f64,
        notes: &mut Vec<String>,
    ) -> Parsed<Vec<f64>> {
        let count = self.frames.len();
        let (first, last) = (self.planes[0], self.planes[count - 1]);
        let length = self.places[count - 1] - self.places[0];
        let [row, column] = first.along;
        let drift = |direction: DVec3, size: f64| {
            let drift = direction.dot(last.position - first.position);
            if length > 0.0 && drift.abs() > STRAIGHT * size {
                drift / length
            } else {
                0.0
            }
        };
        for (direction, size, name) in [
            (row, between_columns, "row"),
            (column, between_rows, "column"),
        ] {
            for (n, plane) in self.planes.iter().enumerate() {
                let expected = drift(direction, size) * (self.places[n] - self.places[0]);
                let found = direction.dot(plane.position - first.position);
                if (found - expected).abs() > ASTRAY * size {
                    return Err(format!(
                        "{} lies {:.3} mm along its {name}s beside the line of the others, \
                         expected slices one behind the other",
                        images[self.frames[n].image]
                            .frame_name(frame(images, self.frames[n]).index),
                        found - expected
                    ));
                }
            }
        }
        check_right_angle("i and k", drift(row, between_columns).atan().sin())?;
        if drift(column, between_rows).abs() <= SHEAR {
            return Ok(vec![0.0; count]);
        }
        notes.push(format!(
            "the gantry was tilted by {:.2} degrees, which is sheared out",
            drift(column, between_rows).atan().to_degrees().abs()
        ));
        let below = |plane: &Plane| column.dot(plane.position) / between_rows;
        let lows: Vec<f64> = self.planes.iter().map(below).collect();
        let [highest, lowest] =
            [f64::min, f64::max].map(|of| lows.iter().copied().reduce(of).unwrap_or(0.0));
        // The last row of the lowest slice is the volume's last row, as dcm2niix has it.
        let spread = lowest - highest;
        let above = (spread - EXACT).ceil().max(spread) - lowest;
        Ok(lows.into_iter().map(|low| low + above).collect())
    }
}

/// Millimetres by which the positions of one place may differ.
fn rounding(images: &[Image], group: &Group) -> f64 {
    const OF_PIXEL: f64 = 5e-3;
    let pixel = frame(images, group.frames[0]).pixel_spacing;
    pixel.map_or(0.0, |[rows, columns]| OF_PIXEL * rows.min(columns))
}

/// The median distance between places that are apart by more than `rounding`.
fn usual_distance(all: &[(f64, At)], rounding: f64) -> f64 {
    let mut distances: Vec<f64> = all.windows(2).map(|pair| pair[1].0 - pair[0].0).collect();
    let longest = distances.iter().copied().fold(0.0, f64::max);
    distances.retain(|distance| *distance > rounding.max(1e-4 * longest));
    median(&distances).unwrap_or(0.0)
}
