//! The allowed numbers, directions and words in a scene file: the checks that all tables share.

use std::fmt::Display;
use std::str::FromStr;

use glam::DVec3;

use super::SceneFile;
use crate::error::{Error, Result, figure};
use crate::scene::RADIANCES;
use crate::scene::volume::VOXEL_SIZES;

/// A test of numbers, and the name of its range in messages. The GPU computes in single precision, so numbers that
/// overflow there are wrong everywhere.
pub type Expected = (fn(f64) -> bool, &'static str);

pub(super) const FINITE: Expected = (|_| true, "a finite number within ±3e38");
pub(super) const UNIT: Expected = (|x| (0.0..=1.0).contains(&x), "a number from 0 to 1");
pub(super) const NOT_NEGATIVE: Expected = (|x| x >= 0.0, "a finite number from 0 to 3e38");
/// Allowed sides of a voxel, in world units.
pub(super) const VOXEL_SIZE: Expected = (
    |x| VOXEL_SIZES.contains(&x),
    "a number from 1e-15 to 1e15, if need be in another unit of length",
);
/// Allowed radiances and irradiances.
pub(super) const LIGHT: Expected = (
    |x| x == 0.0 || RADIANCES.contains(&x),
    "0 or a number from 1e-15 to 1e15, if need be in another unit of light",
);
/// The exponent of a Phong lobe. With a larger one the lobe is so narrow that rounding of the cosine decides whether a
/// direction lies in it, and it goes missing.
pub(super) const SHININESS: Expected = (|x| (0.0..=1e12).contains(&x), "a number from 0 to 1e12");
pub(super) const POSITIVE: Expected = (|x| x > 0.0, "a finite number > 0, up to 3e38");

impl SceneFile {
    pub(super) fn number(&self, key: &str, value: f64, (holds, expected): Expected) -> Result<f64> {
        if value.abs() <= f64::from(f32::MAX) && holds(value) {
            return Ok(value);
        }
        Err(self
            .origins
            .error(key, format!("found {}, expected {expected}", figure(value))))
    }

    pub(super) fn triple(
        &self,
        key: &str,
        value: [f64; 3],
        expected: Expected,
    ) -> Result<[f64; 3]> {
        for component in value {
            self.number(key, component, expected).map_err(|_| {
                let found = format!("found {value:?}, expected each to be {}", expected.1);
                self.origins.error(key, found)
            })?;
        }
        Ok(value)
    }

    /// The unit vector of a vector that is not zero, and its length. A vector that has unit length already stays as
    /// it is to the last bit, so that a printed scene reads back as the same scene.
    pub(super) fn direction(&self, key: &str, vector: [f64; 3]) -> Result<([f64; 3], f64)> {
        self.triple(key, vector, FINITE)?;
        let length = DVec3::from(vector).length();
        if length < f64::from(f32::MIN_POSITIVE) {
            let found = format!("found {vector:?}, expected a direction, which is not zero");
            return Err(self.origins.error(key, found));
        }
        if (length - 1.0).abs() < 4.0 * f64::EPSILON {
            return Ok((vector, 1.0));
        }
        Ok((vector.map(|x| x / length), length))
    }

    pub(super) fn word<T: FromStr<Err: Display>>(
        &self,
        key: &str,
        word: &Option<String>,
    ) -> Result<Option<T>> {
        let parse = |word: &String| {
            let wrong = |expected| -> Error {
                self.origins
                    .error(key, format!("found \"{word}\", {expected}"))
            };
            word.parse().map_err(wrong)
        };
        word.as_ref().map(parse).transpose()
    }
}
