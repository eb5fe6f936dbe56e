//! Where a grid's voxels lie in the world: `openvdb/math/Maps.h`.

use super::stream::Stream;
use crate::scene::volume::orientation::{Coordinates, Orientation};
use crate::scene::volume::parsed::Parsed;

/// The voxel size and the axes' handedness; the inner fault counts unless the user gives both.
pub type Geometry = Parsed<([f64; 3], Orientation)>;

pub fn read(stream: &mut Stream) -> Parsed<Geometry> {
    let name = stream.text()?;
    let steps = match name.as_str() {
        "UniformScaleMap" | "ScaleMap" => scales(stream, 0)?,
        "UniformScaleTranslateMap" | "ScaleTranslateMap" => scales(stream, 1)?,
        "TranslationMap" => {
            vector(stream)?;
            [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]]
        }
        "AffineMap" | "UnitaryMap" => matrix(stream)?,
        other => {
            return Err(format!(
                "it has the transform `{other}`, expected one that keeps lines parallel; resample it, with `vdb_tool` or \
                 OpenVDB's `tools::resampleToMatch`"
            ));
        }
    };
    Ok(Orientation::from_steps(steps, Coordinates::RightHanded))
}

fn vector(stream: &mut Stream) -> Parsed<[f64; 3]> {
    Ok([stream.f64()?, stream.f64()?, stream.f64()?])
}

/// Scales along the axes, after so many other vectors. The voxel size and three sorts of reciprocals follow.
fn scales(stream: &mut Stream, before: usize) -> Parsed<[[f64; 3]; 3]> {
    for _ in 0..before {
        vector(stream)?;
    }
    let [x, y, z] = vector(stream)?;
    for _ in 0..4 {
        vector(stream)?;
    }
    Ok([[x, 0.0, 0.0], [0.0, y, 0.0], [0.0, 0.0, z]])
}

/// The rows of a matrix are where a step along each axis leads, since OpenVDB multiplies row vectors.
fn matrix(stream: &mut Stream) -> Parsed<[[f64; 3]; 3]> {
    let mut steps = [[0.0; 3]; 4];
    for step in &mut steps {
        *step = vector(stream)?;
        stream.f64()?;
    }
    let [i, j, k, _] = steps;
    Ok([i, j, k])
}
