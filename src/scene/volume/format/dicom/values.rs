//! Conversion from a frame's stored values to the volume's numbers.
//!
//! Each slice may have a slope and an intercept of its own. As long as they lead to whole numbers of one unit, such
//! as Hounsfield units, the volume's numbers are integers, of the narrowest type that holds all values that could be
//! stored, if need be with an offset. Otherwise they are floats.

use crate::scene::volume::format::header::check_rescale;
use crate::scene::volume::parsed::Parsed;
use crate::scene::volume::stored::each;
use crate::scene::volume::voxel_type::{Endian, VoxelType};

use super::frame::Frame;
use super::image::{Image, Padding, Samples};
use super::unpack::Unpacked;

/// Differences from whole numbers that count as rounding: of offsets, and relative ones of factors, so that no factor
/// is taken for 0.
const ROUNDING: f64 = 1e-6;

/// The meaning of a volume's numbers: a value is `intercept` + `slope` · number.
#[derive(Debug)]
pub struct Values {
    pub voxel_type: VoxelType,
    /// The slope, which is positive.
    pub slope: f64,
    pub intercept: f64,
    /// The conversion of each frame, in the stack's order.
    pub maps: Vec<Map>,
}

/// Conversion from a stored value to a number.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Map {
    Whole { factor: i64, offset: i64 },
    Real { slope: f64, intercept: f64 },
}

impl Values {
    pub fn of(frames: &[(&Image, &Frame)]) -> Parsed<Values> {
        // In PET, a slice without counts has the slope 0. If all slices have it, the slope is meaningless, and 1 is used.
        let is_blank = |(_, frame): &(&Image, &Frame)| frame.slope == 0.0;
        let slope: fn(&Frame) -> f64 = if frames.iter().all(is_blank) {
            |_: &Frame| 1.0
        } else {
            |frame: &Frame| frame.slope
        };
        for (_, frame) in frames.iter().filter(|frame| !is_blank(frame)) {
            check_rescale(frame.slope, frame.intercept)?;
        }
        Ok(Values::whole(frames, slope).unwrap_or_else(|| Values::real(frames, slope)))
    }

    fn real(frames: &[(&Image, &Frame)], slope: fn(&Frame) -> f64) -> Values {
        let map = |(_, frame): &(&Image, &Frame)| Map::Real {
            slope: slope(frame),
            intercept: frame.intercept,
        };
        Values {
            voxel_type: VoxelType::F32,
            slope: 1.0,
            intercept: 0.0,
            maps: frames.iter().map(map).collect(),
        }
    }

    fn whole(frames: &[(&Image, &Frame)], slope_of: fn(&Frame) -> f64) -> Option<Values> {
        let (_, first) = frames.first()?;
        let mut units = frames.iter().map(|(_, frame)| slope_of(frame).abs());
        let unit = units.clone().find(|unit| *unit > 0.0)?;
        let has_one_unit = units.all(|own| own == unit || own == 0.0);
        let (slope, base) = if has_one_unit {
            (unit, first.intercept)
        } else {
            (1.0, 0.0)
        };
        let mut maps = Vec::new();
        let (mut low, mut high) = (i64::MAX, i64::MIN);
        for (image, frame) in frames {
            let ratio = slope_of(frame) / slope;
            let factor = whole(ratio, ROUNDING * ratio.abs())?;
            let offset = whole((frame.intercept - base) / slope, ROUNDING)?;
            for stored in image.samples.limits()? {
                low = low.min(factor * stored + offset);
                high = high.max(factor * stored + offset);
            }
            maps.push((factor, offset));
        }
        let (voxel_type, shift) = narrowest(low, high)?;
        let map = |(factor, offset)| Map::Whole {
            factor,
            offset: offset - shift,
        };
        Some(Values {
            voxel_type,
            slope,
            intercept: base + slope * shift as f64,
            maps: maps.into_iter().map(map).collect(),
        })
    }
}

/// A number that is whole but for a rounding of at most `tolerance`, and not so large that products would overflow.
fn whole(number: f64, tolerance: f64) -> Option<i64> {
    let rounded = number.round();
    let rounds_to_integer =
        (number - rounded).abs() <= tolerance && rounded.abs() <= f64::from(1 << 30);
    rounds_to_integer.then_some(rounded as i64)
}

/// The narrowest type for all whole numbers from `low` to `high`, and the offset to subtract from them.
fn narrowest(low: i64, high: i64) -> Option<(VoxelType, i64)> {
    const TYPES: [(VoxelType, i64, i64); 6] = [
        (VoxelType::U8, 0, 0xff),
        (VoxelType::I8, -0x80, 0x7f),
        (VoxelType::U16, 0, 0xffff),
        (VoxelType::I16, -0x8000, 0x7fff),
        (VoxelType::U32, 0, 0xffff_ffff),
        (VoxelType::I32, -0x8000_0000, 0x7fff_ffff),
    ];
    let holds = |(_, least, most): &&(VoxelType, i64, i64)| *least <= low && high <= *most;
    let found = TYPES.iter().find(holds).map(|(voxel_type, ..)| *voxel_type);
    match (found, high - low) {
        (Some(voxel_type), _) if voxel_type.bytes() <= 2 => Some((voxel_type, 0)),
        (_, 0..=0xffff) => Some((VoxelType::U16, low)),
        (Some(voxel_type), _) => Some((voxel_type, 0)),
        (None, _) => None,
    }
}

impl Samples {
    /// The smallest and the largest value that can be stored, for integers.
    pub fn limits(self) -> Option<[i64; 2]> {
        match self {
            Samples::Integers {
                stored, is_signed, ..
            } => Some(if is_signed {
                [-(1 << (stored - 1)), (1 << (stored - 1)) - 1]
            } else {
                [0, (1 << stored) - 1]
            }),
            Samples::Float | Samples::Double => None,
        }
    }

    /// Integers that have all bits of their words.
    fn of_words(self) -> Samples {
        match self {
            Samples::Integers {
                allocated,
                is_signed,
                ..
            } => Samples::Integers {
                allocated,
                stored: allocated,
                high: allocated - 1,
                is_signed,
            },
            reals => reals,
        }
    }
}

/// Conversion from the words of one frame to numbers.
#[derive(Debug, Clone, Copy)]
pub struct FrameConversion {
    pub samples: Samples,
    /// The byte order of the words.
    pub endian: Endian,
    pub padding: Option<Padding>,
    /// The number in place of padding.
    pub filler: f64,
    pub map: Map,
    pub to: VoxelType,
}

impl FrameConversion {
    /// The conversion of all words of a frame, with no regard to padding.
    pub fn new(unpacked: &Unpacked, map: Map, to: VoxelType) -> FrameConversion {
        FrameConversion {
            samples: unpacked.samples,
            endian: unpacked.endian,
            padding: None,
            filler: 0.0,
            map,
            to,
        }
    }

    /// Converts one voxel after another.
    pub fn convert(&self, words: &[u8], numbers: &mut [u8]) {
        match self.samples {
            Samples::Float => self.reals(words, numbers, |word| {
                f32::from_bits(self.endian.u32(word)).into()
            }),
            Samples::Double => {
                self.reals(words, numbers, |word| f64::from_bits(self.endian.u64(word)))
            }
            Samples::Integers { allocated: 8, .. } => self.integers::<1>(words, numbers),
            Samples::Integers { allocated: 16, .. } => self.integers::<2>(words, numbers),
            Samples::Integers { .. } => self.integers::<4>(words, numbers),
        }
    }

    fn reals<const N: usize>(
        &self,
        words: &[u8],
        numbers: &mut [u8],
        real: impl Fn([u8; N]) -> f64,
    ) {
        let Map::Real { slope, intercept } = self.map else {
            return;
        };
        each(words, numbers, |word| {
            ((intercept + slope * real(word)) as f32).to_ne_bytes()
        });
    }

    fn integers<const N: usize>(&self, words: &[u8], numbers: &mut [u8]) {
        let stored = self.stored::<N>();
        let is_padding = self.is_padding::<N>();
        match self.map {
            Map::Whole { factor, offset } => {
                // 32 bits suffice for all but the widest values, and are twice as fast.
                let is_narrow = N <= 2 && factor.abs() == 1 && offset.abs() < 1 << 30;
                match (self.padding, is_narrow) {
                    (None, true) => {
                        let (factor, offset) = (factor as i32, offset as i32);
                        let whole = |word| factor * stored(word) as i32 + offset;
                        match self.to.bytes() {
                            1 => each(words, numbers, |word| (whole(word) as u8).to_ne_bytes()),
                            2 => each(words, numbers, |word| (whole(word) as u16).to_ne_bytes()),
                            _ => each(words, numbers, |word| whole(word).to_ne_bytes()),
                        }
                    }
                    _ => {
                        let filler = self.filler as i64;
                        let whole = |word| {
                            if is_padding(word) {
                                filler
                            } else {
                                factor * stored(word) + offset
                            }
                        };
                        match self.to.bytes() {
                            1 => each(words, numbers, |word| (whole(word) as u8).to_ne_bytes()),
                            2 => each(words, numbers, |word| (whole(word) as u16).to_ne_bytes()),
                            _ => each(words, numbers, |word| (whole(word) as u32).to_ne_bytes()),
                        }
                    }
                }
            }
            Map::Real { slope, intercept } => each(words, numbers, |word| {
                let value = if is_padding(word) {
                    self.filler
                } else {
                    intercept + slope * stored(word) as f64
                };
                (value as f32).to_ne_bytes()
            }),
        }
    }

    /// A word's stored value.
    fn stored<const N: usize>(&self) -> impl Fn([u8; N]) -> i64 + use<N> {
        stored(self.samples, self.endian)
    }

    /// Whether a word stands for no measurement.
    fn is_padding<const N: usize>(&self) -> impl Fn([u8; N]) -> bool + use<N> {
        let is_of_words = self.padding.is_some_and(|padding| padding.is_of_words);
        let samples = if is_of_words {
            self.samples.of_words()
        } else {
            self.samples
        };
        let value = stored(samples, self.endian);
        let range = self.padding.map(|padding| padding.range);
        move |word| range.is_some_and(|[first, last]| (first..=last).contains(&value(word)))
    }

    /// The smallest and largest numbers of a frame that stand for measurements.
    pub fn range(&self, words: &[u8]) -> Option<[f64; 2]> {
        match self.samples {
            Samples::Integers { allocated: 8, .. } => self.range_of::<1>(words),
            Samples::Integers { allocated: 16, .. } => self.range_of::<2>(words),
            Samples::Integers { .. } => self.range_of::<4>(words),
            Samples::Float | Samples::Double => {
                let mut numbers = vec![0; words.len() / self.samples.bytes() as usize * 4];
                self.convert(words, &mut numbers);
                let numbers = numbers
                    .as_chunks()
                    .0
                    .iter()
                    .map(|bytes| f32::from_ne_bytes(*bytes));
                let finite = numbers.filter(|number| number.is_finite()).map(f64::from);
                finite.fold(None, |range, number| Some(joined(range, [number; 2])))
            }
        }
    }

    fn range_of<const N: usize>(&self, words: &[u8]) -> Option<[f64; 2]> {
        let stored = self.stored::<N>();
        let is_padding = self.is_padding::<N>();
        let (mut low, mut high) = (i64::MAX, i64::MIN);
        for word in words.as_chunks().0 {
            let value = stored(*word);
            let is_real = !is_padding(*word);
            low = low.min(if is_real { value } else { i64::MAX });
            high = high.max(if is_real { value } else { i64::MIN });
        }
        let number = |stored: i64| match self.map {
            Map::Whole { factor, offset } => (factor * stored + offset) as f64,
            Map::Real { slope, intercept } => intercept + slope * stored as f64,
        };
        let (first, last) = (low <= high).then(|| (number(low), number(high)))?;
        Some([first.min(last), first.max(last)])
    }
}

/// The union of two ranges.
pub fn joined(range: Option<[f64; 2]>, other: [f64; 2]) -> [f64; 2] {
    let [low, high] = range.unwrap_or(other);
    [low.min(other[0]), high.max(other[1])]
}

/// The value of integer words: the bits in use, with their sign.
fn stored<const N: usize>(samples: Samples, endian: Endian) -> impl Fn([u8; N]) -> i64 + use<N> {
    let Samples::Integers {
        stored,
        high,
        is_signed,
        ..
    } = samples
    else {
        unreachable!("floats have no stored integers");
    };
    let (left, right) = (31 - high, 32 - stored);
    move |word| {
        let mut bits: u32 = 0;
        for n in 0..N {
            let place = match endian {
                Endian::Little => n,
                Endian::Big => N - 1 - n,
            };
            bits |= u32::from(word[place]) << (8 * n);
        }
        if is_signed {
            i64::from(((bits << left) as i32) >> right)
        } else {
            i64::from((bits << left) >> right)
        }
    }
}
