//! Where the voxels are in the body, by whichever of a header's transforms there are.

use super::fields::Fields;
use crate::scene::volume::orientation::{Axes, Coordinates, Orientation};
use crate::scene::volume::parsed::Parsed;

/// The affine "sform" if there is one, else the rotation "qform", else nothing but voxel sizes. Where the sform is a
/// registration that shears, the qform beside it is where the scanner saw the voxels.
pub fn geometry(
    fields: &Fields,
    count: usize,
    is_spacing_known: bool,
    notes: &mut Vec<String>,
) -> Parsed<([f64; 3], Orientation)> {
    let orientation = match (sform(fields), qform(fields)) {
        (Some(Ok(affine)), _) => return Ok(affine),
        (Some(Err(fault)), Some(Ok(orientation))) => {
            notes.push(format!("{fault}; the qform is used instead"));
            orientation
        }
        (Some(Err(fault)), _) => return Err(fault),
        (None, Some(orientation)) => orientation?,
        (None, None) => Orientation::UNKNOWN,
    };
    let (spacing, unknown) = voxel_size(fields, count);
    if !is_spacing_known {
        notes.extend(unknown);
    }
    Ok((spacing, orientation))
}

/// Some programs write an sform of zeros, which is none.
fn sform(fields: &Fields) -> Option<Parsed<([f64; 3], Orientation)>> {
    let places = fields.places;
    let rows: [[f64; 4]; 3] =
        std::array::from_fn(|row| fields.floats(places.srow + 4 * places.real * row));
    (fields.code(places.sform_code) > 0 && rows != [[0.0; 4]; 3]).then(|| {
        let steps = std::array::from_fn(|axis| rows.map(|row| row[axis]));
        Orientation::from_steps(steps, Coordinates::Anatomical(Axes::RAS))
            .map_err(|fault| format!("sform: {fault}"))
    })
}

fn qform(fields: &Fields) -> Option<Parsed<Orientation>> {
    let places = fields.places;
    (fields.code(places.qform_code) > 0).then(|| {
        let [handedness] = fields.floats(places.pixdim);
        let mut directions = rotation(fields.floats(places.quatern));
        if handedness < 0.0 {
            directions[2] = directions[2].map(|x| -x);
        }
        match Orientation::from_steps(directions, Coordinates::Anatomical(Axes::RAS)) {
            Ok((_, orientation)) => Ok(orientation),
            Err(fault) => Err(format!("qform: {fault}")),
        }
    })
}

/// The voxel size by `pixdim`, of which only the amount counts: some programs mark a reversed axis by a sign. With a note for
/// each axis along which it is unknown.
fn voxel_size(fields: &Fields, count: usize) -> ([f64; 3], Vec<String>) {
    let pixdim: [f64; 4] = fields.floats(fields.places.pixdim);
    let mut unknown = Vec::new();
    let spacing = [1, 2, 3].map(|axis| match pixdim[axis].abs() {
        // A 2D image need not say how thick it is.
        _ if axis > count => 1.0,
        0.0 => {
            unknown.push(format!(
                "`pixdim[{axis}]` is 0, and counts as 1; if that is wrong, set volume.spacing"
            ));
            1.0
        }
        size => size,
    });
    (spacing, unknown)
}

/// The directions of i, j and k from the last three components of a unit quaternion.
fn rotation([b, c, d]: [f64; 3]) -> [[f64; 3]; 3] {
    let a = (1.0 - b * b - c * c - d * d).max(0.0).sqrt();
    // Rounding to float leaves half turns a bit longer than 1.
    let length = (a * a + b * b + c * c + d * d).sqrt();
    let [a, b, c, d] = [a, b, c, d].map(|x| x / length);
    [
        [
            a * a + b * b - c * c - d * d,
            2.0 * (b * c + a * d),
            2.0 * (b * d - a * c),
        ],
        [
            2.0 * (b * c - a * d),
            a * a + c * c - b * b - d * d,
            2.0 * (c * d + a * b),
        ],
        [
            2.0 * (b * d + a * c),
            2.0 * (c * d - a * b),
            a * a + d * d - b * b - c * c,
        ],
    ]
}
