//! The contents of one file: an image with its frames, and where each of them lies in the patient; or the reason why
//! it is no part of a volume.

use crate::scene::volume::parsed::Parsed;
use crate::scene::volume::source::file::MOST_DEFLATED;
use crate::scene::volume::voxel_type::Endian;

use super::data_set::{DataSet, numeric};
use super::elements::Pixels;
use super::file::{FilePart, Parsing};
use super::frame::{Frame, frames};
use super::other::{COLOUR_REMEDY, Other, UNPLACED, colours, other, should_have_pixels};
use super::syntax::{GDCMCONV, Packing, TransferSyntax};
use super::tags::{self, Tag};

/// The kind of a file's contents.
#[derive(Debug)]
pub enum Content {
    Image(Box<Image>),
    /// A list of files.
    Directory(Vec<Vec<String>>),
    /// DICOM, and no part of a volume.
    Other(Other),
}

#[derive(Debug, Clone)]
pub struct Image {
    pub place: FilePart,
    pub transfer: TransferSyntax,
    pub pixels: Pixels,
    /// Offsets of the frames among the fragments, if a table gives them.
    pub offsets: Vec<u64>,
    pub modality: String,
    pub series_uid: String,
    pub series_number: i64,
    /// Its number in the series.
    pub instance: Option<i64>,
    pub description: String,
    pub rows: u32,
    pub columns: u32,
    pub samples: Samples,
    /// Whether the smallest value is shown as white. That says nothing of what it means (PS3.3 C.7.6.3.1.2).
    pub low_is_white: bool,
    pub padding: Option<Padding>,
    /// "HU", "BQML" and the like.
    pub units: Option<String>,
    /// Frames in the file, of which `frames` has those that may be part of a volume.
    pub frame_count: u32,
    pub frames: Vec<Frame>,
    /// The fault of its pixels, if one is known already.
    pub damage: Option<String>,
}

/// Values that stand for no measurement.
#[derive(Debug, Clone, Copy)]
pub struct Padding {
    /// Both ends included.
    pub range: [i64; 2],
    /// Some writers give a padding of 16 bits for values of fewer bits. It is then sought among whole words, all of
    /// whose bits count.
    pub is_of_words: bool,
}

/// The encoding of a stored value.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Samples {
    Integers {
        /// 8, 16 or 32.
        allocated: u32,
        /// The number of bits in use, of which `high` is the top one.
        stored: u32,
        high: u32,
        is_signed: bool,
    },
    Float,
    Double,
}

impl Samples {
    pub fn bytes(self) -> u64 {
        match self {
            Samples::Integers { allocated, .. } => u64::from(allocated / 8),
            Samples::Float => 4,
            Samples::Double => 8,
        }
    }
}

/// Interprets a header. A fault is a sentence about the file.
pub fn interpret(parsing: Parsing) -> Parsed<Content> {
    let data = &parsing.data_set;
    if let Some(files) = listed_files(data) {
        return Ok(Content::Directory(files));
    }
    if let Some(other) = other(data) {
        return Ok(Content::Other(other));
    }
    let Some(pixels) = parsing.pixels else {
        if should_have_pixels(data) {
            return Err("has no pixels, expected those of a slice: the file is truncated".into());
        }
        return Ok(no_part(
            "object without pixels",
            "has no pixels, expected an image",
        ));
    };
    if let Some(other) = unread(data) {
        return Ok(Content::Other(other));
    }
    let samples = samples(data, pixels)?;
    if parsing.transfer.syntax.endian == Endian::Big && pixels.is_words && samples.bytes() == 1 {
        return Err(format!(
            "its 8-bit pixels are in big-endian words, which is not supported; {GDCMCONV}"
        ));
    }
    let image = Image::new(parsing, pixels, samples)?;
    if image.frames.is_empty() {
        let why = format!(
            "has {} frames that do not say where they lie in the patient, expected ImagePositionPatient, \
             ImageOrientationPatient and SpacingBetweenSlices",
            image.frame_count
        );
        return Ok(no_part(UNPLACED, &why));
    }
    Ok(Content::Image(Box::new(image)))
}

/// The files that a directory lists.
fn listed_files(data: &DataSet) -> Option<Vec<Vec<String>>> {
    let records = data.items(tags::DIRECTORY_RECORDS);
    if records.is_empty() {
        return None;
    }
    let files = records
        .iter()
        .map(|record| record.texts(tags::REFERENCED_FILE));
    Some(files.filter(|file| !file.is_empty()).collect())
}

/// Kinds of pixels that are not read.
fn unread(data: &DataSet) -> Option<Other> {
    if let Some(colours) = colours(data) {
        return Some(Other {
            kind: "colour image",
            why: format!("its pixels are {colours}, {COLOUR_REMEDY}"),
        });
    }
    let (kind, why) = if data.has(tags::VALUE_TABLE) && data.text(tags::SLOPE).is_none() {
        (
            "image with a table of values",
            "its values pass through a table (Modality LUT Sequence), expected a slope and an intercept",
        )
    } else if data.u16(tags::BITS_ALLOCATED) == Some(1) {
        ("bitmap", "has 1 bit a pixel, expected 8, 16 or 32")
    } else {
        return None;
    };
    let why = why.to_string();
    Some(Other { kind, why })
}

impl Image {
    fn new(parsing: Parsing, pixels: Pixels, samples: Samples) -> Parsed<Image> {
        let data = &parsing.data_set;
        let size = |tag, name| match data.whole(tag) {
            Some(size) if (1..=u16::MAX.into()).contains(&size) => Ok(size),
            found => Err(format!(
                "its {name} is {}, expected 1 to 65535",
                found.map_or("missing".into(), |size| size.to_string())
            )),
        };
        // A number without which the image is as good.
        let number = |tag, name| data.decimal(tag, name).ok().flatten();
        let mut image = Image {
            transfer: parsing.transfer,
            pixels,
            offsets: data.longs(tags::OFFSET_TABLE),
            modality: data.text(tags::MODALITY).unwrap_or_default(),
            series_uid: data.text(tags::SERIES_UID).unwrap_or_default(),
            series_number: number(tags::SERIES_NUMBER, "SeriesNumber").unwrap_or(0.0) as i64,
            instance: number(tags::INSTANCE, "InstanceNumber").map(|number| number as i64),
            description: data.text(tags::SERIES_DESCRIPTION).unwrap_or_default(),
            rows: size(tags::ROWS, "number of rows (Rows)")?,
            columns: size(tags::COLUMNS, "number of columns (Columns)")?,
            samples,
            low_is_white: low_is_white(data),
            padding: padding(data, samples),
            units: units(data),
            frame_count: frame_count(data)?,
            frames: Vec::new(),
            damage: None,
            place: parsing.place,
        };
        image.damage = image.check_length().err();
        image.frames = frames(data, image.frame_count, image.place.bytes())?;
        Ok(image)
    }
}

fn no_part(kind: &'static str, why: &str) -> Content {
    let why = why.to_string();
    Content::Other(Other { kind, why })
}

fn samples(data: &DataSet, pixels: Pixels) -> Parsed<Samples> {
    match pixels.tag {
        tags::FLOAT_PIXELS => return Ok(Samples::Float),
        tags::DOUBLE_PIXELS => return Ok(Samples::Double),
        _ => {}
    }
    let number = |tag| data.u16(tag).map(u32::from);
    let allocated =
        number(tags::BITS_ALLOCATED).ok_or("its BitsAllocated is missing, expected 8, 16 or 32")?;
    if ![8, 16, 32].contains(&allocated) {
        return Err(format!(
            "its BitsAllocated is {allocated}, expected 8, 16 or 32"
        ));
    }
    let stored = number(tags::BITS_STORED).unwrap_or(allocated);
    let high = number(tags::HIGH_BIT).unwrap_or(stored.max(1) - 1);
    if stored == 0 || stored > high + 1 || high >= allocated {
        return Err(format!(
            "its BitsStored is {stored} and its HighBit {high}, expected bits within the {allocated} \
             allocated"
        ));
    }
    let is_signed = number(tags::PIXEL_REPRESENTATION) == Some(1);
    Ok(Samples::Integers {
        allocated,
        stored,
        high,
        is_signed,
    })
}

fn low_is_white(data: &DataSet) -> bool {
    data.text(tags::PHOTOMETRIC).as_deref() == Some("MONOCHROME1")
}

fn padding(data: &DataSet, samples: Samples) -> Option<Padding> {
    let Samples::Integers {
        allocated,
        stored,
        is_signed,
        ..
    } = samples
    else {
        return None;
    };
    let value = |tag: Tag| {
        let word = i64::from(data.whole(tag)?);
        // A padding that needs more bits than are allocated is no stored value, unless it is a negative one whose sign was
        // extended.
        let is_negative = is_signed && i64::from(word as i16) >= -(1 << (allocated - 1));
        if word >> allocated != 0 && !is_negative {
            return None;
        }
        let is_stored = word >> stored == 0;
        let unused = 64 - if is_stored { stored } else { allocated };
        Some(if is_signed {
            (word << unused) >> unused
        } else {
            ((word as u64) << unused >> unused) as i64
        })
    };
    let first = value(tags::PADDING)?;
    let last = value(tags::PADDING_LIMIT).unwrap_or(first);
    let range = [first.min(last), first.max(last)];
    let holds = |[low, high]: [i64; 2]| low <= range[0] && range[1] <= high;
    Some(Padding {
        range,
        is_of_words: !samples.limits().is_some_and(holds),
    })
}

fn units(data: &DataSet) -> Option<String> {
    let known = [tags::RESCALE_TYPE, tags::UNITS, tags::DOSE_UNITS];
    let shared = data.item(tags::SHARED_GROUPS);
    let first = data.items(tags::FRAME_GROUPS).first();
    let groups = [first, shared].into_iter().flatten();
    let transformed = groups.filter_map(|group| group.item(tags::VALUE_TRANSFORMATION));
    let unit = transformed
        .chain([data])
        .find_map(|data| known.iter().find_map(|tag| data.text(*tag)));
    // A code's value has at most 16 characters.
    unit.map(|unit| unit.chars().take(16).collect())
}

fn frame_count(data: &DataSet) -> Parsed<u32> {
    let Some(text) = data.text(tags::FRAMES) else {
        return Ok(1);
    };
    match text.parse() {
        Ok(0) => Ok(1),
        Ok(count) => Ok(count),
        Err(_) => Err(format!(
            "its NumberOfFrames is `{}`, expected a whole number",
            numeric(&text)
        )),
    }
}

impl Image {
    /// A fault of this file, with its name unless the user has named the file.
    pub fn named(&self, fault: &str) -> String {
        match self.place.name.as_str() {
            "" => fault.to_string(),
            name => format!("{name}: {fault}"),
        }
    }

    /// The name of one of its frames in messages.
    pub fn frame_name(&self, index: u32) -> String {
        match (self.place.name.as_str(), self.frame_count) {
            (name, 1) if !name.is_empty() => name.to_string(),
            ("", _) => format!("frame {}", index + 1),
            (name, _) => format!("frame {} of {name}", index + 1),
        }
    }

    /// Whether another image has frames of the same size at the same places.
    pub fn lies_like(&self, other: &Image) -> bool {
        let size = |image: &Image| (image.columns, image.rows, image.frames.len());
        let position = |frame: &Frame| frame.plane.map(|plane| plane.position);
        let mut pairs = self.frames.iter().zip(&other.frames);
        size(self) == size(other) && pairs.all(|(a, b)| position(a) == position(b))
    }

    pub fn frame_pixels(&self) -> u64 {
        u64::from(self.rows) * u64::from(self.columns)
    }

    /// The size of an unpacked frame.
    pub fn frame_bytes(&self) -> u64 {
        self.frame_pixels() * self.samples.bytes()
    }

    /// Fails unless plain pixels are all there. Packed ones are counted when they are unpacked, but a file whose
    /// pixels begin after its end holds none.
    fn check_length(&self) -> Parsed<()> {
        let packing = self.transfer.packing.map_err(|remedy| {
            format!(
                "its pixels are packed as {}, which is not read; {remedy}",
                self.transfer.name
            )
        })?;
        let expected = u128::from(self.frame_bytes()) * u128::from(self.frame_count);
        let said = self.pixels.length.map_or(u128::MAX, u128::from);
        let there = if self.place.is_deflated {
            u128::from(self.place.bytes()) * u128::from(MOST_DEFLATED)
        } else {
            u128::from(self.place.bytes().saturating_sub(self.pixels.at))
        };
        let found = said.min(there);
        if packing != Packing::Plain {
            let most = there.saturating_mul(packing.most_pixels().into());
            let pixels = u128::from(self.frame_pixels()) * u128::from(self.frame_count);
            return if pixels <= most {
                Ok(())
            } else {
                Err(format!(
                    "its {there} bytes of {} cannot hold {} frames of {}×{}: the file is truncated, or its \
                     header wrong",
                    self.transfer.name, self.frame_count, self.columns, self.rows
                ))
            };
        }
        if found < expected {
            return Err(format!(
                "holds {found} bytes of pixels, expected {expected} for {} × {} × {} pixels of {} bytes \
                 each: the file is truncated, or its header wrong",
                self.frame_count,
                self.columns,
                self.rows,
                self.samples.bytes()
            ));
        }
        Ok(())
    }
}
