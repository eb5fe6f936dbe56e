//! The picture: how units of samples become a mean with its error, and what else there is of it.
//!
//! [`units`] takes samples, unit after unit or in a [`bundle`] of units, and [`accumulate`] folds each unit into the mean.
//! [`sums`] and [`halves`] say how far the mean may be off, [`film`] is what is read back, [`iso_depth`] the picture's other
//! layers, and [`tone_map`] shows it on a display.

pub(super) mod accumulate;
pub(super) mod bundle;
mod difference;
mod film;
pub(super) mod halves;
pub(super) mod iso_depth;
mod sums;
pub(super) mod tone_map;
pub(super) mod totals;
pub(super) mod under_way;
mod units;

pub use difference::mean_square;
pub use film::{Film, FirstHits};
pub use halves::Halves;
pub use sums::{Sums, variance};
pub use tone_map::ToneMapPush;
pub use totals::Totals;
