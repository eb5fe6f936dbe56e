//! ImageJ's description of the first page: `key=value` lines.
//!
//! ImageJ's pages come channel by channel, then slice by slice, then time by time. For a stack without compression it
//! may write only the first page's directory, and all pixels one after another: that is how it gets beyond 4 GB.

use super::meaning::{Axis, Meaning};
use super::page::Layout;
use super::voxel_size::VoxelSize;
use crate::scene::volume::format::header::check_rescale;
use crate::scene::volume::parsed::{Parsed, unexpected};

pub const START: &str = "ImageJ=";

/// The number of pages according to the description; 1 if it does not say.
pub fn images(description: &str) -> Parsed<u64> {
    count(description, "images")
}

/// How many pixels along x and y are as long as a unit, by the tags that every TIFF file may have.
pub struct Resolution {
    pub pixels: [Option<f64>; 2],
    /// 1 is a unit without a name, 2 are inches and 3 centimetres.
    pub unit: Option<u64>,
}

/// The dots of an inch that programs write which know no size.
const NO_SIZE: f64 = 72.0;

impl Resolution {
    /// The lengths of a pixel and their unit, for a description that names no unit.
    fn undescribed(&self) -> ([Option<f64>; 2], Option<&'static str>) {
        let unit = match self.unit {
            Some(1) => None,
            Some(2) if self.pixels[0].is_some_and(|n| n != NO_SIZE) => Some("inch"),
            Some(3) => Some("cm"),
            _ => return ([None; 2], None),
        };
        (self.lengths(), unit)
    }

    fn lengths(&self) -> [Option<f64>; 2] {
        self.pixels.map(|pixels| pixels.map(|n| 1.0 / n))
    }

    /// The lengths of a pixel in the unit that a description names. Some microscopes' programs count pixels in a
    /// centimetre, as the tag says, and name micrometres; ImageJ knows that.
    fn lengths_in(&self, unit: &str) -> [Option<f64>; 2] {
        const MICROMETRES: f64 = 1e4;
        let scale = if unit == "um" && self.unit == Some(3) {
            MICROMETRES
        } else {
            1.0
        };
        self.lengths().map(|length| length.map(|n| scale * n))
    }
}

pub fn meaning(
    description: &str,
    pages: usize,
    layout: &Layout,
    resolution: &Resolution,
) -> Parsed<Meaning> {
    let [channels, slices, frames] =
        ["channels", "slices", "frames"].map(|key| count(description, key));
    let (channels, slices, frames) = (channels?, slices?, frames?);
    let planes = channels.saturating_mul(slices).saturating_mul(frames);
    let depth = value(description, "spacing").and_then(|text| text.parse::<f64>().ok());
    let depth = depth.map(f64::abs).filter(|depth| depth.is_normal());
    // In a stack ImageJ leaves out a distance of 1, and in a single image any.
    let depth = depth.or((images(description)? > 1).then_some(1.0));
    // Units of y and z stand there only if they differ from that of x.
    let [unit, of_y, of_z] = ["unit", "yunit", "zunit"].map(|key| unit(description, key));
    let named = value(description, "unit");
    let (lengths, units) = match unit {
        Some(_) => (
            resolution.lengths_in(named.unwrap_or_default()),
            [unit, of_y.or(unit), of_z.or(unit)],
        ),
        // It counts in pixels.
        None if named.is_some() => ([None; 2], [None; 3]),
        None => {
            let (lengths, unit) = resolution.undescribed();
            (lengths, [unit; 3])
        }
    };
    let [x, y] = lengths;
    let mut meaning = Meaning {
        size: VoxelSize::new("ImageJ", [x, y, depth], units, 1.0),
        ..Meaning::stack(pages, layout.samples)
    };
    // ImageJ calibrates integers of 8 and 16 bits only.
    if layout.voxel_type.bytes() <= 2 && !layout.voxel_type.is_float() {
        meaning.calibrate(description);
    }
    // Numbers that do not fit the file are those of a stack that was changed by another program.
    if planes == pages as u64 {
        meaning = meaning.along(&[
            (Axis::Time, frames as usize),
            (Axis::Slice, slices as usize),
            (Axis::Channel, channels as usize),
        ]);
    }
    Ok(meaning)
}

impl Meaning {
    /// Takes over the calibration of values. ImageJ stores signed numbers as unsigned ones with a calibration.
    fn calibrate(&mut self, description: &str) {
        const STRAIGHT_LINE: &str = "0";
        const NONE: &str = "20";
        let Some(function) = value(description, "cf").filter(|function| *function != NONE) else {
            return;
        };
        let [c0, c1] = ["c0", "c1"].map(|key| value(description, key)?.parse::<f64>().ok());
        match (function, c0, c1) {
            (STRAIGHT_LINE, Some(intercept), Some(slope))
                if check_rescale(slope, intercept).is_ok() =>
            {
                (self.intercept, self.slope) = (intercept, slope);
            }
            _ => self.notes.push(
                "ImageJ's calibration of its values is no straight line; they are taken as they are"
                    .into(),
            ),
        }
    }
}

/// A unit of length; `None` if none is stated, or lengths are counted in pixels.
fn unit<'a>(description: &'a str, key: &str) -> Option<&'a str> {
    let unit = value(description, key).filter(|unit| !["", "pixel"].contains(unit))?;
    Some(match unit {
        "\\u00B5m" | "micron" | "um" => "µm",
        other => other,
    })
}

fn value<'a>(description: &'a str, key: &str) -> Option<&'a str> {
    let mut lines = description.lines();
    lines.find_map(|line| Some(line.strip_prefix(key)?.strip_prefix('=')?.trim()))
}

fn count(description: &str, key: &str) -> Parsed<u64> {
    let Some(text) = value(description, key) else {
        return Ok(1);
    };
    let count = text
        .parse()
        .ok()
        .filter(|count| (1..=u64::from(u32::MAX)).contains(count));
    count.ok_or_else(|| {
        let key = format!("{key} of ImageJ's description");
        unexpected(&key, text, "a whole number from 1 up")
    })
}
