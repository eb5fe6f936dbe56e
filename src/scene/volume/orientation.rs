//! The directions in which i, j and k grow in the body, and whether they form a right-handed system.
//!
//! A header gives them as a direction matrix, as letters, or not at all. The world axes are the index axes in any
//! case, so all that is kept of a matrix is the voxel size, the nearest letter for each axis, and the handedness,
//! which decides whether the volume would be seen as its mirror image.

use std::fmt;
use std::str::FromStr;

use glam::{DMat3, DVec3};

use crate::error::{Error, Result};

/// The anatomical directions in which i, j and k grow.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Axes(pub [Anatomical; 3]);

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Anatomical {
    Left,
    Right,
    Anterior,
    Posterior,
    Superior,
    Inferior,
}

use Anatomical::*;

const NAMES: [(Anatomical, &str); 6] = [
    (Left, "left"),
    (Right, "right"),
    (Anterior, "anterior"),
    (Posterior, "posterior"),
    (Superior, "superior"),
    (Inferior, "inferior"),
];

/// Cosine of the angle between two axes from which they count as sheared: over 512 voxels the
/// picture would be off by half a voxel.
pub(super) const SHEAR: f64 = 1e-3;

impl Anatomical {
    pub fn opposite(self) -> Anatomical {
        match self {
            Left => Right,
            Right => Left,
            Anterior => Posterior,
            Posterior => Anterior,
            Superior => Inferior,
            Inferior => Superior,
        }
    }

    /// "left", "right", … in full.
    pub fn name(self) -> &'static str {
        NAMES[self as usize].1
    }

    /// The unit vector in DICOM's left-posterior-superior coordinates, which are right-handed.
    fn direction(self) -> [f64; 3] {
        match self {
            Left => [1.0, 0.0, 0.0],
            Right => [-1.0, 0.0, 0.0],
            Posterior => [0.0, 1.0, 0.0],
            Anterior => [0.0, -1.0, 0.0],
            Superior => [0.0, 0.0, 1.0],
            Inferior => [0.0, 0.0, -1.0],
        }
    }
}

impl Axes {
    pub const LPS: Axes = Axes([Left, Posterior, Superior]);
    pub const RAS: Axes = Axes([Right, Anterior, Superior]);

    /// Axes for three directions, unless two of them are on one line.
    fn distinct(letters: [Anatomical; 3]) -> Option<Axes> {
        let axes = Axes(letters);
        (determinant(axes.directions()) != 0.0).then_some(axes)
    }

    /// Axes spelt out, as in "left-posterior-superior".
    pub(super) fn from_names(names: &str) -> Option<Axes> {
        let letters: Vec<Anatomical> = names
            .split('-')
            .map(|word| NAMES.iter().find(|(_, name)| *name == word))
            .map(|found| found.map(|(direction, _)| *direction))
            .collect::<Option<_>>()?;
        Axes::distinct(letters.try_into().ok()?)
    }

    pub fn left_handed(self) -> bool {
        determinant(self.directions()) < 0.0
    }

    pub(super) fn opposite(self) -> Axes {
        Axes(self.0.map(Anatomical::opposite))
    }

    fn directions(self) -> [[f64; 3]; 3] {
        self.0.map(Anatomical::direction)
    }
}

impl FromStr for Axes {
    type Err = Error;

    fn from_str(text: &str) -> Result<Axes> {
        let letter = |c: char| {
            let found = NAMES.iter().find(|(_, name)| name.starts_with(c));
            found.map(|(direction, _)| *direction)
        };
        text.to_ascii_lowercase()
            .chars()
            .map(letter)
            .collect::<Option<Vec<_>>>()
            .and_then(|letters| letters.try_into().ok())
            .and_then(Axes::distinct)
            .ok_or_else(|| {
                let expected = "expected one of L|R, one of A|P and one of S|I in any order, \
                                where i, j and k grow, such as \"LPS\"";
                Error::value(expected)
            })
    }
}

impl fmt::Display for Axes {
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        self.0
            .iter()
            .try_for_each(|direction| write!(f, "{}", direction.name()[..1].to_uppercase()))
    }
}

/// The coordinates in which a header gives its directions.
#[derive(Debug, Clone, Copy)]
pub(super) enum Coordinates {
    Anatomical(Axes),
    RightHanded,
    LeftHanded,
}

impl Coordinates {
    fn left_handed(self) -> bool {
        match self {
            Coordinates::Anatomical(axes) => axes.left_handed(),
            Coordinates::RightHanded => false,
            Coordinates::LeftHanded => true,
        }
    }
}

/// The part of a header's orientation that is kept.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Orientation {
    pub axes: Option<Axes>,
    pub left_handed: bool,
}

impl Orientation {
    pub const UNKNOWN: Orientation = Orientation {
        axes: None,
        left_handed: false,
    };

    /// Voxel size and orientation from the steps that i, j and k make in the frame's coordinates.
    pub fn from_steps(
        steps: [[f64; 3]; 3],
        frame: Coordinates,
    ) -> std::result::Result<([f64; 3], Orientation), String> {
        let spacing = steps.map(|step| DVec3::from(step).length());
        for a in 0..3 {
            if !spacing[a].is_normal() {
                return Err(format!(
                    "the direction of axis {} is {:?}, expected finite numbers that are not all zero",
                    ["i", "j", "k"][a],
                    steps[a]
                ));
            }
        }
        let units: [[f64; 3]; 3] = std::array::from_fn(|a| steps[a].map(|x| x / spacing[a]));
        for (a, b, names) in [(0, 1, "i and j"), (0, 2, "i and k"), (1, 2, "j and k")] {
            check_right_angle(names, DVec3::from(units[a]).dot(units[b].into()))?;
        }
        let left_handed = (determinant(units) < 0.0) != frame.left_handed();
        let axes = match frame {
            Coordinates::Anatomical(world) => Some(nearest(units, world, left_handed)),
            Coordinates::RightHanded | Coordinates::LeftHanded => None,
        };
        Ok((spacing, Orientation { axes, left_handed }))
    }
}

/// Fails if two axes, whose angle has this cosine, are sheared.
pub(super) fn check_right_angle(names: &str, cosine: f64) -> std::result::Result<(), String> {
    if cosine.abs() > SHEAR {
        Err(format!(
            "axes {names} are sheared: {:.2} degrees apart, expected 90; resample the volume to a \
             rectangular grid",
            cosine.clamp(-1.0, 1.0).acos().to_degrees()
        ))
    } else {
        Ok(())
    }
}

impl From<Axes> for Orientation {
    fn from(axes: Axes) -> Orientation {
        Orientation {
            axes: Some(axes),
            left_handed: axes.left_handed(),
        }
    }
}

/// The letters nearest to the axes' directions, among all that have their handedness. Choosing all three at once
/// keeps them distinct for any obliqueness.
fn nearest(units: [[f64; 3]; 3], world: Axes, left_handed: bool) -> Axes {
    let opposite = world.opposite();
    let score = |letters: [Anatomical; 3]| -> f64 {
        let along = |a: usize| {
            let unit = units[a];
            (0..3)
                .map(|w| match letters[a] {
                    letter if letter == world.0[w] => unit[w],
                    letter if letter == opposite.0[w] => -unit[w],
                    _ => 0.0,
                })
                .sum::<f64>()
        };
        (0..3).map(along).sum()
    };
    let letter = |n: usize| NAMES[n % 6].0;
    (0..6 * 6 * 6)
        .filter_map(|n| Axes::distinct([letter(n), letter(n / 6), letter(n / 36)]))
        .filter(|axes| axes.left_handed() == left_handed)
        .max_by(|a, b| score(a.0).total_cmp(&score(b.0)))
        .unwrap_or(world)
}

fn determinant([a, b, c]: [[f64; 3]; 3]) -> f64 {
    DMat3::from_cols_array_2d(&[a, b, c]).determinant()
}
