//! OME's metadata of an image: its axes, its resolutions and the names of its channels.

use std::collections::HashSet;
use std::path::{Component, Path, PathBuf};

use serde::Deserialize;

use super::array::Array;
use super::metadata::json;
use super::{Dimension, Resolution};
use crate::scene::volume::parsed::{Parsed, unexpected};

/// The most resolutions, each of which is usually half as large as the one before.
const MOST_LEVELS: usize = 64;

#[derive(Deserialize)]
struct Attributes {
    multiscales: Option<Vec<Multiscale>>,
    omero: Option<Omero>,
    plate: Option<serde::de::IgnoredAny>,
    #[serde(rename = "bioformats2raw.layout")]
    collection: Option<serde::de::IgnoredAny>,
}

/// The attributes of a group of Zarr 3.
#[derive(Deserialize)]
struct Group {
    attributes: Option<InGroup>,
}

#[derive(Deserialize)]
struct InGroup {
    ome: Option<Attributes>,
}

#[derive(Deserialize)]
struct Multiscale {
    axes: Option<Vec<AxisEntry>>,
    /// As in version 0.6, in place of `axes`.
    #[serde(rename = "coordinateSystems")]
    systems: Option<serde::de::IgnoredAny>,
    datasets: Vec<Dataset>,
    #[serde(rename = "coordinateTransformations")]
    transforms: Option<Vec<Transform>>,
}

#[derive(Deserialize)]
#[serde(
    untagged,
    expecting = "one of `axes` is none of OME-Zarr, expected its `name`, `type` and `unit`"
)]
enum AxisEntry {
    /// As in version 0.3.
    Name(String),
    Described {
        name: String,
        #[serde(rename = "type")]
        kind: Option<String>,
        unit: Option<String>,
    },
}

#[derive(Deserialize)]
struct Dataset {
    path: String,
    #[serde(rename = "coordinateTransformations")]
    transforms: Option<Vec<Transform>>,
}

#[derive(Deserialize)]
struct Transform {
    #[serde(rename = "type")]
    kind: String,
    scale: Option<Vec<f64>>,
}

#[derive(Deserialize)]
struct Omero {
    channels: Option<Vec<Channel>>,
}

#[derive(Deserialize)]
struct Channel {
    label: Option<String>,
}

/// The file in which a group describes its arrays.
pub fn metadata_file(group: &Path) -> PathBuf {
    let newer = group.join("zarr.json");
    if newer.is_file() {
        newer
    } else {
        group.join(".zattrs")
    }
}

/// The axes, resolutions and channels' names of an image.
pub fn image(path: &Path) -> Parsed<(Vec<Dimension>, Vec<Resolution>, Vec<String>)> {
    let metadata = metadata_file(path);
    let attributes: Option<Attributes> = if metadata.ends_with("zarr.json") {
        let group: Group = json(&metadata)?;
        group.attributes.and_then(|attributes| attributes.ome)
    } else if metadata.is_file() {
        Some(json(&metadata)?)
    } else {
        None
    };
    let attributes = attributes
        .ok_or("is a Zarr group without OME's metadata; open an image or an array in it")?;
    let Some(image) = attributes
        .multiscales
        .and_then(|all| all.into_iter().next())
    else {
        return Err(match (attributes.plate, attributes.collection) {
            (Some(_), _) => "is a plate of images; open one of them, as in PLATE/A/1/0",
            (_, Some(_)) => "is a collection of images; open one of them, as in FOLDER/0",
            _ => "is a Zarr group without `multiscales`; open an image or an array in it",
        }
        .into());
    };
    let axes = image.axes.ok_or(match image.systems {
        Some(_) => {
            "is OME-Zarr 0.6 or later, with `coordinateSystems`, expected 0.4 or 0.5, with `axes`"
        }
        None => "`multiscales` has no `axes`: it is older than OME-Zarr 0.3",
    })?;
    let dimensions = axes.into_iter().map(|axis| match axis {
        AxisEntry::Name(name) => Dimension::new(&name, None, None),
        AxisEntry::Described { name, kind, unit } => Dimension::new(&name, kind.as_deref(), unit),
    });
    let dimensions: Vec<Dimension> = dimensions.collect();
    check_datasets(&image.datasets)?;
    let resolutions = image.datasets.iter().map(|dataset| {
        let transforms = dataset.transforms.iter().chain(&image.transforms).flatten();
        resolution(path, &dataset.path, transforms, dimensions.len())
    });
    let resolutions = resolutions.collect::<Parsed<_>>()?;
    let channels = attributes.omero.and_then(|omero| omero.channels);
    let names = channels.into_iter().flatten();
    let names = names.map(|channel| channel.label.unwrap_or_default());
    Ok((dimensions, resolutions, names.collect()))
}

fn check_datasets(datasets: &[Dataset]) -> Parsed<()> {
    let distinct: HashSet<&str> = datasets.iter().map(|it| it.path.as_str()).collect();
    let count = datasets.len();
    if (1..=MOST_LEVELS).contains(&count) && distinct.len() == count {
        return Ok(());
    }
    Err(format!(
        "`datasets` has {count} entries with {} paths, expected 1 to {MOST_LEVELS} resolutions, each with a path of its own",
        distinct.len()
    ))
}

/// The array in a folder of the image's, and the product of its scales along so many axes.
fn resolution<'a>(
    image: &Path,
    folder: &str,
    transforms: impl Iterator<Item = &'a Transform>,
    axes: usize,
) -> Parsed<Resolution> {
    let inner = Path::new(folder);
    let is_inside = |part: Component| matches!(part, Component::Normal(_) | Component::CurDir);
    if !inner.components().all(is_inside) {
        return Err(unexpected("path", folder, "a folder inside this one"));
    }
    let array =
        Array::read(&image.join(inner)).map_err(|fault| format!("its array {folder}: {fault}"))?;
    let mut scale = vec![1.0; axes];
    for transform in transforms {
        if let ("scale", Some(factors)) = (transform.kind.as_str(), &transform.scale) {
            for (scale, factor) in scale.iter_mut().zip(factors) {
                *scale *= factor;
            }
        }
    }
    if array.shape.len() != axes {
        return Err(format!(
            "its array {folder} has {} axes, but its metadata {axes}",
            array.shape.len()
        ));
    }
    Ok(Resolution { array, scale })
}
