//! Makes slices at equal distances from slices at any distances.

use crate::error::first_of;
use crate::scene::volume::parsed::Parsed;

/// Tolerance as a part of a slice's distance: a frame nearer than this to a slice's place is that slice, and two
/// frames nearer than this to each other are at one place.
pub const EXACT: f64 = 0.01;
/// A part of a slice's distance that is rounding, and needs no interpolation.
const ROUNDING: f64 = 1e-6;
/// Slices count as missing where distances are multiples of the usual one within this part of it.
const MULTIPLE: f64 = 0.1;
/// The most places that one message names.
const MOST_NAMED: usize = 6;
/// The most interpolated slices for each real one; with more of them a volume would be invented.
pub const MOST_INVENTED: f64 = 10.0;

/// A slice of the volume: (1 − share)·below + share·above, both indices of frames.
#[derive(Debug, Clone, Copy)]
pub struct Slice {
    pub below: usize,
    pub above: usize,
    pub share: f64,
}

impl Slice {
    pub fn exact(frame: usize) -> Slice {
        Slice {
            below: frame,
            above: frame,
            share: 0.0,
        }
    }
}

/// Slices at equal distances.
pub struct EvenSlices {
    pub spacing: f64,
    pub slices: Vec<Slice>,
    pub gaps: Option<String>,
}

impl EvenSlices {
    /// Even slices from those at `places`, which grow by `distances`, and are as thick as `thickness` says where that is
    /// known. A single slice is as high as that, or 1.
    ///
    /// # Errors
    ///
    /// If most of the even slices would have to be invented.
    pub fn of(
        places: &[f64],
        distances: &[f64],
        thickness: &[Option<f64>],
        notes: &mut Vec<String>,
    ) -> Parsed<EvenSlices> {
        let (Some(usual), Some(middle)) = (lower_median(distances), median(distances)) else {
            return Ok(EvenSlices {
                spacing: thickness[0].unwrap_or(1.0),
                slices: vec![Slice::exact(0)],
                gaps: None,
            });
        };
        // The usual distance is one that occurs: slices that are missing are seen by multiples of it.
        let steps = |distance: f64| (distance / usual).round();
        let is_multiple = |distance: &f64| {
            let steps = steps(*distance);
            steps >= 1.0 && (distance - usual * steps).abs() <= MULTIPLE * usual
        };
        let has_steps = distances.iter().all(is_multiple);
        let all_steps: f64 = distances.iter().copied().map(steps).sum();
        let length = places[places.len() - 1] - places[0];
        let count = places_in(length, middle);
        let most = if has_steps {
            count.max(all_steps)
        } else {
            count
        };
        if most.is_nan() || most > MOST_INVENTED * places.len() as f64 {
            let [least, most] = extremes(distances).map(shown);
            return Err(format!(
                "its {} slices are {least} to {most} mm apart, expected slices at about equal distances",
                places.len(),
            ));
        }
        let expected = expected_distances(thickness, distances, usual);
        let gaps = missing(places, distances, &expected);
        let is_of_one_kind = expected.iter().all(|distance| *distance == usual);
        let grid = (has_steps && is_of_one_kind)
            .then(|| EvenPlaces::through(places, distances.iter().copied().map(steps)))
            .filter(|grid| grid.hold(places));
        let even = match grid {
            Some(grid) => grid.slices(places),
            None => EvenSlices::resampled(places, distances, middle, notes),
        };
        Ok(EvenSlices { gaps, ..even })
    }

    /// Slices at other places than the even ones, of which a note tells.
    fn resampled(
        places: &[f64],
        distances: &[f64],
        spacing: f64,
        notes: &mut Vec<String>,
    ) -> EvenSlices {
        let length = places[places.len() - 1] - places[0];
        let count = places_in(length, spacing) as usize;
        let place = |n: usize| places[0] + n as f64 * spacing;
        let farthest = (0..count).map(|n| to_nearest(places, place(n)));
        let [least, most] = extremes(distances).map(shown);
        notes.push(format!(
            "slices are {least} to {most} mm apart and resampled linearly to the median, {} mm: new slices are up to {} mm \
             from given ones",
            shown(spacing),
            shown(farthest.fold(0.0, f64::max))
        ));
        let slices = (0..count).map(|n| between(places, place(n), ROUNDING * spacing));
        EvenSlices {
            spacing: decimal(spacing),
            slices: slices.collect(),
            gaps: None,
        }
    }
}

/// The number of places at this distance along a length, both ends included.
fn places_in(length: f64, spacing: f64) -> f64 {
    (length / spacing + EXACT).floor() + 1.0
}

/// Places at equal distances that come nearest to those of slices, by least squares: each slice's place is rounded for
/// itself, also those of the first and of the last.
struct EvenPlaces {
    first: f64,
    spacing: f64,
    /// The number of each slice among these places, ascending from 0.
    numbers: Vec<f64>,
}

impl EvenPlaces {
    /// `steps` are those from each of `places` to the next.
    fn through(places: &[f64], steps: impl Iterator<Item = f64>) -> EvenPlaces {
        let mut numbers = vec![0.0];
        numbers.extend(steps.scan(0.0, |number, steps| {
            *number += steps;
            Some(*number)
        }));
        let mean = |values: &[f64]| values.iter().sum::<f64>() / values.len() as f64;
        let (mean_number, mean_place) = (mean(&numbers), mean(places));
        let pairs = || numbers.iter().zip(places);
        let covariance: f64 = pairs()
            .map(|(number, place)| (number - mean_number) * (place - mean_place))
            .sum();
        let variance: f64 = numbers.iter().map(|n| (n - mean_number).powi(2)).sum();
        let spacing = covariance / variance;
        EvenPlaces {
            first: mean_place - mean_number * spacing,
            spacing,
            numbers,
        }
    }

    fn place(&self, number: f64) -> f64 {
        self.first + number * self.spacing
    }

    /// Whether all slices lie here.
    fn hold(&self, places: &[f64]) -> bool {
        let mut pairs = self.numbers.iter().zip(places);
        pairs.all(|(number, place)| (place - self.place(*number)).abs() <= EXACT * self.spacing)
    }

    /// The slices that lie here, and in place of those that are missing interpolated ones.
    fn slices(&self, places: &[f64]) -> EvenSlices {
        let slices = self.numbers.windows(2).zip(0..).flat_map(|(pair, below)| {
            let steps = pair[1] - pair[0];
            let missing = (1..steps as usize).map(move |n| Slice {
                below,
                above: below + 1,
                share: n as f64 / steps,
            });
            [Slice::exact(below)].into_iter().chain(missing)
        });
        EvenSlices {
            spacing: decimal(self.spacing),
            slices: slices.chain([Slice::exact(places.len() - 1)]).collect(),
            gaps: None,
        }
    }
}

/// The smallest and the largest of the distances.
fn extremes(distances: &[f64]) -> [f64; 2] {
    [
        distances.iter().copied().fold(f64::INFINITY, f64::min),
        distances.iter().copied().fold(0.0, f64::max),
    ]
}

/// The distance from each slice to the next that is to be expected, where `usual` is that of most. It is larger where slices
/// are thicker and touch: those of such a thickness never overlap, as two distances at least show.
fn expected_distances(thickness: &[Option<f64>], distances: &[f64], usual: f64) -> Vec<f64> {
    let is_same = |a: f64, b: f64| (a - b).abs() <= EXACT * a;
    // Each thickness of two neighbours, how many distances there are between such, and the smallest.
    let mut kinds: Vec<(f64, usize, f64)> = Vec::new();
    for (pair, distance) in thickness.windows(2).zip(distances) {
        match *pair {
            [Some(a), Some(b)] if is_same(a, b) => {
                match kinds.iter_mut().find(|(thick, ..)| is_same(*thick, a)) {
                    Some((_, count, least)) => {
                        *count += 1;
                        *least = least.min(*distance);
                    }
                    None => kinds.push((a, 1, *distance)),
                }
            }
            _ => {}
        }
    }
    let touch = |thick: f64| {
        let mut kinds = kinds.iter();
        let kind = kinds.find(|(other, ..)| is_same(*other, thick));
        kind.is_some_and(|(_, count, least)| *count >= 2 && *least >= (1.0 - MULTIPLE) * thick)
    };
    let expected = |pair: &[Option<f64>]| match *pair {
        [Some(a), Some(b)] if a.max(b) > (1.0 + MULTIPLE) * usual && touch(a.max(b)) => a.max(b),
        _ => usual,
    };
    thickness.windows(2).map(expected).collect()
}

/// A sentence that names the places where slices are missing, if any are. `expected` are the distances without any.
fn missing(places: &[f64], distances: &[f64], expected: &[f64]) -> Option<String> {
    let pairs = distances.iter().zip(expected).zip(places);
    let between = pairs.flat_map(|((distance, expected), place)| {
        let steps = (distance / expected).round();
        let is_multiple = (distance - steps * expected).abs() <= MULTIPLE * expected;
        let count = if is_multiple { steps as usize } else { 1 };
        (1..count).map(move |n| place + n as f64 * distance / count as f64)
    });
    let missing: Vec<String> = between
        .map(|place| format!("{} mm", shown(place)))
        .collect();
    let are = if missing.len() == 1 { "is" } else { "are" };
    (!missing.is_empty()).then(|| {
        format!(
            "{} of {} slices {are} missing, at {} along the slices' normal",
            missing.len(),
            missing.len() + places.len(),
            first_of(&missing, MOST_NAMED)
        )
    })
}

/// The distance from a place to the nearest of others, which ascend.
fn to_nearest(places: &[f64], place: f64) -> f64 {
    let above = places.partition_point(|other| *other < place);
    let beside = &places[above.saturating_sub(1)..places.len().min(above + 1)];
    let distances = beside.iter().map(|other| (other - place).abs());
    distances.fold(f64::INFINITY, f64::min)
}

/// The slice at a place: the frame that is not farther from it than `near`, or an interpolation between two.
fn between(places: &[f64], place: f64, near: f64) -> Slice {
    let above = places.partition_point(|other| *other < place - near);
    let last = places.len() - 1;
    if above > last {
        return Slice::exact(last);
    }
    if above == 0 || places[above] <= place + near {
        return Slice::exact(above);
    }
    let below = above - 1;
    Slice {
        below,
        above,
        share: (place - places[below]) / (places[above] - places[below]),
    }
}

/// A distance without the last bits of its calculation: headers give places in decimal fractions of a millimetre.
fn decimal(millimetres: f64) -> f64 {
    let rounded = (millimetres * 1e9).round() / 1e9;
    if (rounded - millimetres).abs() <= 1e-9 * millimetres {
        rounded
    } else {
        millimetres
    }
}

/// A length with as many digits as a header gives.
fn shown(millimetres: f64) -> f64 {
    (millimetres * 1e4).round() / 1e4
}

/// The value in the middle, or the lower one of the two in the middle.
fn lower_median(values: &[f64]) -> Option<f64> {
    let mut sorted = values.to_vec();
    sorted.sort_by(f64::total_cmp);
    sorted.get(sorted.len().checked_sub(1)? / 2).copied()
}

/// The value in the middle, or halfway between the two in the middle.
pub fn median(values: &[f64]) -> Option<f64> {
    let mut sorted = values.to_vec();
    sorted.sort_by(f64::total_cmp);
    let (low, high) = (sorted.len().checked_sub(1)? / 2, sorted.len() / 2);
    Some(0.5 * (sorted[low] + sorted[high]))
}
