//! A frame and its place.
//!
//! A classic file holds one slice. An enhanced one holds many, with groups of elements that belong to one frame or to
//! all of them; all other elements are in the object itself. Looking a value up in that order turns both kinds into a
//! list of the same frames.

use glam::DVec3;

use crate::scene::volume::parsed::Parsed;

use super::data_set::DataSet;
use super::holders::Holders;
use super::setting::{Setting, acquired};
use super::tags;

/// One picture.
#[derive(Debug, Clone)]
pub struct Frame {
    /// Its place in the file.
    pub index: u32,
    pub plane: Option<Plane>,
    /// Millimetres between rows, and between columns.
    pub pixel_spacing: Option<[f64; 2]>,
    /// The distance to the next slice, if the file knows it.
    pub thickness: Option<f64>,
    pub slope: f64,
    pub intercept: f64,
    pub image_type: String,
    pub acquisition: String,
    pub kind: Kind,
    pub setting: Setting,
    /// When it was taken; see [`acquired`].
    pub acquired: String,
}

/// Other properties that distinguish frames at one place, where a file states them.
#[derive(Debug, Clone, PartialEq, Eq, Hash)]
pub struct Kind {
    echo: Option<String>,
    time: Option<String>,
    time_index: Option<u32>,
    /// The bits of a number.
    b_value: Option<u64>,
    stack: Option<String>,
    /// The frame's number in each of [`tags::VECTORS`].
    numbers: Vec<Option<u16>>,
}

impl Frame {
    /// What may tell it apart from frames at the same place, with a word for each; empty where the file does not say.
    pub fn distinctions(&self) -> Vec<(&'static str, String)> {
        let kind = &self.kind;
        let text = |text: &Option<String>| text.clone().unwrap_or_default();
        let index = kind.time_index.map(|index| index.to_string());
        let b_value = kind.b_value.map(|bits| f64::from_bits(bits).to_string());
        let mut distinctions = vec![
            ("image type", self.image_type.clone()),
            ("acquisition", self.acquisition.clone()),
            ("echo", text(&kind.echo)),
            ("time", kind.time.clone().or(index).unwrap_or_default()),
            ("b-value", b_value.unwrap_or_default()),
            ("stack", text(&kind.stack)),
        ];
        distinctions.extend(self.setting.told());
        distinctions
    }

    /// The order of frames at the same place by what `series.rs` tells them apart by, as far as that is numbers.
    pub fn order(&self) -> impl Ord + use<> {
        let whole = |text: &str| text.parse::<i64>().unwrap_or(0);
        let kind = &self.kind;
        (
            whole(&self.acquisition),
            kind.echo.as_deref().map(whole),
            kind.time.as_deref().map(whole),
            kind.time_index,
            kind.b_value,
        )
    }
}

/// Where a slice lies, in millimetres.
#[derive(Debug, Clone, Copy)]
pub struct Plane {
    /// The centre of the first voxel.
    pub position: DVec3,
    /// Unit vectors along a row and along a column.
    pub along: [DVec3; 2],
    /// Whether x grows to the patient's left, y to the back and z to the head. The volumes of ultrasound have axes of
    /// their own.
    pub is_in_patient: bool,
}

fn pixel_spacing(holders: &Holders) -> Parsed<Option<[f64; 2]>> {
    let found = holders.decimals(tags::PIXEL_MEASURES, tags::PIXEL_SPACING, "PixelSpacing")?;
    match found {
        Some([rows, columns]) if rows <= 0.0 || columns <= 0.0 => Err(format!(
            "its PixelSpacing is {rows}\\{columns}, expected two lengths above 0"
        )),
        found => Ok(found),
    }
}

fn stated_plane(holders: &Holders) -> Parsed<Option<Plane>> {
    let name = "ImageOrientationPatient";
    let position =
        holders.decimals(tags::PLANE_POSITION, tags::POSITION, "ImagePositionPatient")?;
    let orientation = holders.decimals(tags::PLANE_ORIENTATION, tags::ORIENTATION, name)?;
    if let (Some(position), Some(orientation)) = (position, orientation) {
        return plane(position, orientation, name, true).map(Some);
    }
    let position = holders.doubles(tags::PLANE_VOLUME_POSITION, tags::VOLUME_POSITION);
    let orientation = holders.doubles(tags::PLANE_VOLUME_ORIENTATION, tags::VOLUME_ORIENTATION);
    let (Some(position), Some(orientation)) = (position, orientation) else {
        return Ok(None);
    };
    plane(position, orientation, "ImageOrientationVolume", false).map(Some)
}

/// A plane; `name` is that of the element with its directions.
fn plane(
    position: [f64; 3],
    [a, b, c, d, e, f]: [f64; 6],
    name: &str,
    is_in_patient: bool,
) -> Parsed<Plane> {
    let along = [DVec3::new(a, b, c), DVec3::new(d, e, f)].map(unit);
    match along {
        [Some(row), Some(column)] if unit(row.cross(column)).is_some() => Ok(Plane {
            position: position.into(),
            along: [row, column],
            is_in_patient,
        }),
        _ => Err(format!(
            "its {name} is {a}\\{b}\\{c}\\{d}\\{e}\\{f}, expected two directions that differ"
        )),
    }
}

/// The direction of a vector, if it has one.
pub fn unit(vector: DVec3) -> Option<DVec3> {
    let length = vector.length();
    (length.is_finite() && length > 1e-6).then(|| length.recip() * vector)
}

/// Whether an image says where its first frame lies, and how large its pixels are.
pub fn has_geometry(data: &DataSet) -> bool {
    let holders = Holders::new(data.item(tags::FRAME_GROUPS), data);
    let geometry = (stated_plane(&holders), pixel_spacing(&holders));
    matches!(geometry, (Ok(Some(_)), Ok(Some(_))))
}

/// The frames of an image of so many, in a file of so many bytes; none if it has several and does not say where they
/// lie.
pub fn frames(data: &DataSet, frame_count: u32, file_bytes: u64) -> Parsed<Vec<Frame>> {
    let each = data.items(tags::FRAME_GROUPS);
    if each.len() as u64 == u64::from(frame_count) {
        let frames = each.iter().zip(0..);
        return frames
            .map(|(own, index)| frame(&Holders::new(Some(own), data), index))
            .collect();
    }
    if !each.is_empty() {
        return Err(format!(
            "it has {frame_count} frames and describes {} of them, expected all: the file is damaged",
            each.len()
        ));
    }
    let first = frame(&Holders::new(None, data), 0)?;
    if frame_count == 1 {
        return Ok(vec![first]);
    }
    let offsets = offsets(data, frame_count, file_bytes)?;
    let (Some(plane), Some(offsets)) = (first.plane, offsets) else {
        return Ok(Vec::new());
    };
    let vectors = tags::VECTORS.map(|tag| data.words(tag));
    let normal = plane.along[0].cross(plane.along[1]);
    let at = |(index, offset): (u32, &f64)| {
        let number = |vector: &Vec<u16>| vector.get(index as usize).copied();
        Frame {
            index,
            plane: Some(Plane {
                position: plane.position + (offset - offsets[0]) * normal,
                ..plane
            }),
            kind: Kind {
                numbers: vectors.iter().map(number).collect(),
                ..first.kind.clone()
            },
            ..first.clone()
        }
    };
    Ok((0..).zip(&offsets).map(at).collect())
}

/// The frames' places along their normal in millimetres; `None` if they are no slices, or do not say where they lie.
fn offsets(data: &DataSet, frame_count: u32, file_bytes: u64) -> Parsed<Option<Vec<f64>>> {
    let offsets = data.decimal_list(tags::FRAME_OFFSETS);
    if offsets.len() as u64 == u64::from(frame_count) {
        return Ok(Some(offsets));
    }
    let Some(spacing) = data.decimal(tags::SLICE_SPACING, "SpacingBetweenSlices")? else {
        return Ok(None);
    };
    let slices = data.words(tags::SLICE_VECTOR);
    if slices.len() as u64 == u64::from(frame_count) {
        let place = |slice: &u16| f64::from(*slice) * spacing;
        return Ok(Some(slices.iter().map(place).collect()));
    }
    // Without slice numbers, frames that are said to differ in something are no slices.
    if !data.words(tags::FRAME_INCREMENT).is_empty() {
        return Ok(None);
    }
    // A frame has at least a byte of the file.
    let count = u64::from(frame_count).min(file_bytes);
    Ok(Some((0..count).map(|n| n as f64 * spacing).collect()))
}

fn frame(holders: &Holders, index: u32) -> Parsed<Frame> {
    let (measures, values) = (tags::PIXEL_MEASURES, tags::VALUE_TRANSFORMATION);
    let spacing = holders.decimal(measures, tags::SLICE_SPACING, "SpacingBetweenSlices")?;
    let thickness = holders.decimal(measures, tags::SLICE_THICKNESS, "SliceThickness")?;
    let slope = match holders.decimal(values, tags::SLOPE, "RescaleSlope")? {
        Some(slope) => Some(slope),
        None => holders.decimal(values, tags::DOSE_SCALE, "DoseGridScaling")?,
    };
    let intercept = holders.decimal(values, tags::INTERCEPT, "RescaleIntercept")?;
    let content = tags::FRAME_CONTENT;
    let frame_type = holders
        .text(tags::MR_FRAME_TYPE, tags::FRAME_TYPE)
        .or_else(|| holders.text(tags::CT_FRAME_TYPE, tags::FRAME_TYPE))
        .or_else(|| holders.text(content, tags::IMAGE_TYPE));
    let acquisition = holders.text(content, tags::ACQUISITION).or_else(|| {
        let number = holders.whole(content, tags::FRAME_ACQUISITION);
        number.map(|number| number.to_string())
    });
    Ok(Frame {
        index,
        plane: stated_plane(holders)?,
        pixel_spacing: pixel_spacing(holders)?,
        thickness: spacing
            .or(thickness)
            .map(f64::abs)
            .filter(|size| *size > 0.0),
        slope: slope.unwrap_or(1.0),
        intercept: intercept.unwrap_or(0.0),
        image_type: frame_type.unwrap_or_default(),
        acquisition: acquisition.unwrap_or_default(),
        kind: Kind {
            echo: holders.text(content, tags::ECHO),
            time: holders.text(content, tags::TEMPORAL_POSITION),
            time_index: holders.whole(content, tags::TEMPORAL_INDEX),
            b_value: holders
                .double(tags::MR_DIFFUSION, tags::B_VALUE)
                .map(f64::to_bits),
            stack: holders.text(content, tags::STACK),
            numbers: Vec::new(),
        },
        setting: Setting::of(holders),
        acquired: acquired(holders),
    })
}
