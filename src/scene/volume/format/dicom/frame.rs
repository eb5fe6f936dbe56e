//! A frame and its place in the patient.
//!
//! A classic file holds one slice. An enhanced one holds many, with groups of elements that belong to one frame or to
//! all of them; all other elements are in the object itself. Looking a value up in that order turns both kinds into a
//! list of the same frames.

use crate::scene::volume::parsed::Parsed;

use super::data_set::DataSet;
use super::tags::{self, Tag};
use super::vector::{self, Vector};

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
    /// All other properties that distinguish frames at one place: echo, time, b-value, stack.
    pub kind: String,
}

/// Where a slice lies in the patient: x to the left, y to the back, z to the head, in millimetres.
#[derive(Debug, Clone, Copy)]
pub struct Plane {
    /// The centre of the first voxel.
    pub position: Vector,
    /// Unit vectors along a row and along a column.
    pub along: [Vector; 2],
}

/// The frames that can be placed, of an image of so many, whose pixels take so many bytes in the file.
pub fn frames(data: &DataSet, frame_count: u32, pixel_bytes: u64) -> Parsed<Vec<Frame>> {
    let (shared, each) = (
        data.item(tags::SHARED_GROUPS),
        data.items(tags::FRAME_GROUPS),
    );
    if each.len() as u64 == u64::from(frame_count) {
        let frames = each.iter().zip(0..);
        return frames
            .map(|(own, index)| frame(&[Some(own), shared, Some(data)], index))
            .collect();
    }
    if !each.is_empty() {
        return Err(format!(
            "it has {} frames and describes {} of them",
            frame_count,
            each.len()
        ));
    }
    let detector = data.item(tags::DETECTORS);
    let first = frame(&[None, shared, Some(data), detector], 0)?;
    if frame_count == 1 {
        return Ok(vec![first]);
    }
    let Some(plane) = first.plane else {
        return Ok(Vec::new());
    };
    let offsets = match (data.decimal_list(tags::FRAME_OFFSETS), detector) {
        (offsets, _) if offsets.len() as u64 == u64::from(frame_count) => offsets,
        (_, Some(_)) => {
            let spacing = data.decimal(tags::SLICE_SPACING, "SpacingBetweenSlices")?;
            let spacing = spacing.ok_or("it has no SpacingBetweenSlices")?;
            // A frame has at least a byte.
            let count = u64::from(frame_count).min(pixel_bytes);
            (0..count).map(|n| n as f64 * spacing).collect()
        }
        _ => return Ok(Vec::new()),
    };
    let normal = vector::cross(plane.along[0], plane.along[1]);
    let at = |(index, offset): (u32, &f64)| Frame {
        index,
        plane: Some(Plane {
            position: vector::moved(plane.position, normal, offset - offsets[0]),
            ..plane
        }),
        ..first.clone()
    };
    Ok((0..).zip(&offsets).map(at).collect())
}

/// A frame. Each of its elements comes from the first of `places` that has it, or from a sequence there.
fn frame(places: &[Option<&DataSet>], index: u32) -> Parsed<Frame> {
    let places: Vec<&DataSet> = places.iter().copied().flatten().collect();
    // The sequence's item where there is one, and the data set itself for a classic object.
    let holder = |sequence: Tag, tag: Tag| {
        let items = places.iter().filter_map(move |place| place.item(sequence));
        let mut holders = items.chain(places.iter().copied());
        holders.find(|holder| holder.text(tag).is_some() || holder.double(tag).is_some())
    };
    let text = |sequence, tag| holder(sequence, tag).and_then(|holder| holder.text(tag));
    let number = |sequence, tag| holder(sequence, tag).and_then(|holder| holder.whole(tag));
    let decimal = |sequence, tag, name| match holder(sequence, tag) {
        Some(holder) => holder.decimal(tag, name),
        None => Ok(None),
    };
    let measures = tags::PIXEL_MEASURES;
    let transformation = tags::VALUE_TRANSFORMATION;
    let pixel_spacing = match holder(measures, tags::PIXEL_SPACING) {
        Some(holder) => holder.decimals(tags::PIXEL_SPACING, "PixelSpacing")?,
        None => None,
    };
    let spacing = decimal(measures, tags::SLICE_SPACING, "SpacingBetweenSlices")?;
    let thickness = decimal(measures, tags::SLICE_THICKNESS, "SliceThickness")?;
    let slope = match decimal(transformation, tags::SLOPE, "RescaleSlope")? {
        Some(slope) => slope,
        None => decimal(transformation, tags::DOSE_SCALE, "DoseGridScaling")?.unwrap_or(1.0),
    };
    let intercept = decimal(transformation, tags::INTERCEPT, "RescaleIntercept")?;
    if slope == 0.0 {
        return Err("its RescaleSlope is 0, expected any other number".into());
    }
    let frame_type = text(tags::MR_FRAME_TYPE, tags::FRAME_TYPE)
        .or_else(|| text(tags::CT_FRAME_TYPE, tags::FRAME_TYPE))
        .or_else(|| text(tags::FRAME_CONTENT, tags::IMAGE_TYPE));
    let content = tags::FRAME_CONTENT;
    let acquisition = text(content, tags::ACQUISITION)
        .or_else(|| number(content, tags::FRAME_ACQUISITION).map(|number| number.to_string()));
    let b_value =
        holder(tags::MR_DIFFUSION, tags::B_VALUE).and_then(|holder| holder.double(tags::B_VALUE));
    Ok(Frame {
        index,
        plane: plane(
            holder(tags::PLANE_POSITION, tags::POSITION),
            holder(tags::PLANE_ORIENTATION, tags::ORIENTATION),
        )?,
        pixel_spacing,
        thickness: spacing
            .or(thickness)
            .map(f64::abs)
            .filter(|size| *size > 0.0),
        slope,
        intercept: intercept.unwrap_or(0.0),
        image_type: frame_type.unwrap_or_default(),
        acquisition: acquisition.unwrap_or_default(),
        kind: format!(
            "{:?} {:?} {:?} {b_value:?} {:?}",
            text(content, tags::ECHO),
            text(content, tags::TEMPORAL_POSITION),
            number(content, tags::TEMPORAL_INDEX),
            text(content, tags::STACK),
        ),
    })
}

fn plane(position: Option<&DataSet>, orientation: Option<&DataSet>) -> Parsed<Option<Plane>> {
    let (Some(position), Some(orientation)) = (position, orientation) else {
        return Ok(None);
    };
    let position = position.decimals(tags::POSITION, "ImagePositionPatient")?;
    let orientation = orientation.decimals::<6>(tags::ORIENTATION, "ImageOrientationPatient")?;
    let (Some(position), Some([a, b, c, d, e, f])) = (position, orientation) else {
        return Ok(None);
    };
    let along = [[a, b, c], [d, e, f]].map(vector::unit);
    match along {
        [Some(row), Some(column)] if vector::unit(vector::cross(row, column)).is_some() => {
            Ok(Some(Plane {
                position,
                along: [row, column],
            }))
        }
        _ => Err(format!(
            "its ImageOrientationPatient is {a}\\{b}\\{c}\\{d}\\{e}\\{f}, expected two directions that \
             differ"
        )),
    }
}
