//! DICOM: a folder of slices, a DICOMDIR, or one file, as scanners write them.
//!
//! Each step is one file. [`find`] examines every file; [`file`], [`elements`] and [`image`] read the contents of
//! one; [`series`] decides which frames belong together; [`stack`] puts them in order and plans how they become a
//! grid; [`values`] converts stored values to numbers; and [`source`] reads voxels on demand, from the frames of a
//! [`frame_reader`], through [`unpack`] where they are packed.
//!
//! These files identify the patient. The elements that do so are never read ([`tags`]), and messages name files,
//! sizes and places only.

mod charset;
mod data_set;
mod duplicates;
mod elements;
mod file;
mod find;
mod fragments;
mod frame;
mod frame_reader;
mod golomb;
mod group;
mod holders;
mod image;
mod interpolation;
mod jpeg_ls;
mod numbers;
mod other;
mod repetition;
mod run_length;
mod series;
mod setting;
mod slices;
mod source;
mod stack;
mod stream;
mod syntax;
mod tags;
mod thumbnail;
mod unpack;
mod values;

use std::collections::HashMap;
use std::path::Path;

use crate::scene::volume::overrides::{Pick, VolumeOverrides};
use crate::scene::volume::parsed::{Fault, Keyed, Parsed};
use crate::scene::volume::quantity::Quantity;
use crate::scene::volume::series::{Preview, Series};
use crate::scene::volume::storage::Storage;
use crate::scene::volume::voxel_type::Endian;

use super::header::{About, Header};
use find::{Found, find};
pub use find::{begins_as_dicom, holds_dicom};
use frame::Frame;
use group::{At, Group, frame};
use image::Image;
use series::group;
use source::StackSource;
use stack::Stack;
use thumbnail::thumbnail;
use values::Values;

/// RescaleType's word for values that have no stated unit.
const UNSPECIFIED: &str = "US";
/// The most other volumes that one message names.
const MOST_NAMED: usize = 8;

/// Whether a file begins like DICOM, whatever its name is, or cannot be read at all, which is reported later.
pub fn is_dicom(path: &Path) -> bool {
    !matches!(file::parse(path), Ok(None))
}

/// The volume that the user has picked, or else the largest.
pub fn read(path: &Path, overrides: &VolumeOverrides) -> Keyed<Header> {
    let mut found = find(path)?;
    let groups = group(&found.images);
    let number = picked(&found, &groups, overrides.series.as_ref())?;
    let mut notes = others(&found, &groups, number);
    notes.extend(found.told_unreadable());
    let group = &groups[number];
    check_undamaged(&found, group)?;
    let mut stack = Stack::new(&found.images, group)?;
    let guess = stack.guess.clone();
    notes.extend(guess.filter(|_| overrides.spacing.is_none()));
    notes.extend(stack.notes.iter().cloned());
    let pairs: Vec<_> = (stack.frames.iter())
        .map(|at| (&found.images[at.image], frame(&found.images, *at)))
        .collect();
    let values = Values::of(&pairs)?;
    let (first, first_frame) = pairs[0];
    let is_alone = found.images.len() == 1 && stack.slices.len() == 1;
    if is_alone && first_frame.plane.is_some() && !path.is_dir() {
        notes.push(
            "it is one slice; to open all slices of its series, give the folder's name".into(),
        );
    }
    let (facts, storage) = (facts(first, &pairs), storage(first));
    if pairs.iter().any(|(image, _)| image.low_is_white) {
        notes.push(
            "files are MONOCHROME1 (low is shown as white): values are as they are stored".into(),
        );
    }
    let quantity = quantity(first);
    let (dims, spacing, orientation) = (stack.dims, stack.spacing, stack.orientation);
    let images = stack.own_images(std::mem::take(&mut found.images));
    let gaps = stack.gaps.clone();
    let source = Box::new(StackSource::new(images, stack, &values)?);
    let remedy = match (&overrides.series, groups.len() - 1) {
        (None, others @ 1..) => other_volumes_hint(others),
        _ => String::new(),
    };
    source.compare_duplicates(&remedy)?;
    match (gaps, overrides.fill_gaps) {
        (Some(gaps), true) => notes.push(format!("{gaps}; they are interpolated")),
        (Some(gaps), false) => return Err((incomplete(&gaps, &found) + &remedy).into()),
        (None, _) => {}
    }
    Ok(Header {
        geometry: Ok((spacing, orientation)),
        slope: values.slope,
        intercept: values.intercept,
        storage,
        notes,
        about: About {
            facts,
            quantity: Some(quantity),
        },
        ..Header::of_source(source, dims, values.voxel_type, Endian::NATIVE)
    })
}

/// Fails if a file of the group is damaged.
fn check_undamaged(found: &Found, group: &Group) -> Parsed<()> {
    let mut images = group.frames.iter().map(|at| &found.images[at.image]);
    images.try_for_each(|image| match &image.damage {
        Some(damage) => Err(image.named(damage)),
        None => Ok(()),
    })
}

/// How such images are stored.
fn storage(image: &Image) -> Storage {
    let packing = image.transfer.name;
    Storage {
        compression: (packing != "none").then(|| packing.to_string()),
        unit: Some("mm".into()),
        ..Storage::default()
    }
}

/// What the values of such images mean.
fn quantity(image: &Image) -> Quantity {
    let is_in_hounsfield =
        (image.units.as_deref()).is_none_or(|unit| unit == "HU" || unit == UNSPECIFIED);
    if image.modality == "CT" && is_in_hounsfield {
        Quantity::Hounsfield
    } else {
        Quantity::Other
    }
}

/// All volumes of a folder, the largest first, as their headers describe them.
pub fn series(path: &Path) -> Parsed<Vec<Series>> {
    let found = find(path)?;
    let groups = group(&found.images);
    if groups.is_empty() {
        return Err(found.why_empty());
    }
    Ok(described(&found.images, &groups)
        .map(|(series, _)| series)
        .collect())
}

/// All volumes of a folder with pictures, where there are several to choose from; none where there is one.
pub fn previews(path: &Path) -> Parsed<Vec<Preview>> {
    let found = find(path)?;
    let groups = group(&found.images);
    if groups.len() < 2 {
        return Ok(Vec::new());
    }
    let previews = described(&found.images, &groups).map(|(series, frames)| Preview {
        series,
        thumbnail: thumbnail(&found.images, &frames).ok(),
    });
    Ok(previews.collect())
}

/// The description of each volume, and its frames, in their order if they have one.
fn described<'a>(
    images: &'a [Image],
    groups: &'a [Group],
) -> impl Iterator<Item = (Series, Vec<At>)> + 'a {
    let told = told_apart(images, groups).into_iter();
    let numbered = groups.iter().zip(1..).zip(told);
    numbered.map(|((group, number), told)| {
        let (mut series, frames) = describe(images, group, number);
        if !told.is_empty() {
            series.notes.insert(0, told);
        }
        (series, frames)
    })
}

/// The description of a volume from its headers, and its frames, in their order if they have one.
fn describe(images: &[Image], group: &Group, number: u32) -> (Series, Vec<At>) {
    let image = &images[group.frames[0].image];
    let mut series = Series {
        number,
        uid: image.series_uid.clone(),
        description: image.description.clone(),
        modality: image.modality.clone(),
        slices: group.frames.len() as u32,
        dims: [image.columns, image.rows, group.frames.len() as u32],
        spacing: [1.0; 3],
        notes: Vec::new(),
    };
    let damaged = group.frames.iter().map(|at| &images[at.image]);
    let damage = damaged.filter_map(|image| {
        let damage = image.damage.as_ref()?;
        Some(image.named(damage))
    });
    series.notes.extend(damage.take(1));
    match Stack::new(images, group) {
        Ok(stack) => {
            series.dims = stack.dims;
            series.spacing = stack.spacing;
            series.slices = stack.frames.len() as u32;
            series.notes.extend(stack.guess);
            series.notes.extend(stack.notes);
            series.notes.extend(stack.gaps);
            (series, stack.frames)
        }
        Err(fault) => {
            series.notes.push(fault);
            (series, group.frames.clone())
        }
    }
}

/// For each volume what tells it apart from others of the same series, as in "echo 2, b-value 1000"; "" if nothing has to.
fn told_apart(images: &[Image], groups: &[Group]) -> Vec<String> {
    let firsts: Vec<(&Image, _)> = (groups.iter())
        .map(|group| group.frames[0])
        .map(|at| (&images[at.image], frame(images, at).distinctions()))
        .collect();
    let mut of_series: HashMap<&str, Vec<_>> = HashMap::new();
    for (image, distinctions) in &firsts {
        let uid = image.series_uid.as_str();
        of_series.entry(uid).or_default().push(distinctions);
    }
    let told = |(image, own): &(&Image, Vec<(&str, String)>)| {
        let beside = &of_series[image.series_uid.as_str()];
        let differs = |i: &usize| {
            let value = &own[*i].1;
            !value.is_empty() && beside.iter().any(|other| other[*i].1 != *value)
        };
        let told = (0..own.len()).filter(differs);
        let told: Vec<String> = told.map(|i| format!("{} {}", own[i].0, own[i].1)).collect();
        told.join(", ")
    };
    let told: Vec<(&str, String)> = (firsts.iter())
        .map(|first| (first.0.series_uid.as_str(), told(first)))
        .collect();
    let number = |n: usize| {
        let instance = firsts[n].0.instance?;
        Some(format!(
            "the first of its slices has InstanceNumber {instance}"
        ))
    };
    // What several have in common tells none of them apart.
    let complete = |(n, own): (usize, &(&str, String))| {
        let is_alone = told.iter().filter(|other| *other == own).count() == 1;
        let told = Some(own.1.clone()).filter(|told| !told.is_empty());
        let number = number(n).filter(|_| !is_alone);
        let parts: Vec<String> = told.into_iter().chain(number).collect();
        parts.join(", ")
    };
    told.iter().enumerate().map(complete).collect()
}

/// A refusal of a volume with gaps: slices may be missing because their files are damaged.
fn incomplete(gaps: &str, found: &Found) -> String {
    let unreadable = found.told_unreadable().map(|told| format!(" ({told})"));
    format!(
        "{gaps}{}, expected slices at equal distances; find them, or have them interpolated with \
         `--set volume.fill_gaps=true`",
        unreadable.unwrap_or_default()
    )
}

/// The end of a refusal of a volume beside which there are others that the user could mean.
fn other_volumes_hint(others: usize) -> String {
    let there_are = match others {
        1 => "there is 1 other volume".to_string(),
        _ => format!("there are {others} other volumes"),
    };
    format!("; {there_are}, which `isolume info FOLDER` lists and `--set volume.series=N` picks")
}

/// The index of the group that the user has picked, or of the largest.
fn picked(found: &Found, groups: &[Group], pick: Option<&Pick>) -> Keyed<usize> {
    if groups.is_empty() {
        return Err(found.why_empty().into());
    }
    let count = groups.len();
    match pick {
        None => Ok(0),
        Some(Pick::Number(number)) => match (*number as usize).checked_sub(1) {
            Some(n) if n < count => Ok(n),
            _ => Err(Fault::of(
                "series",
                format!(
                    "found {number}, expected a number from 1 to {count}, as in `isolume info`"
                ),
            )),
        },
        Some(Pick::Uid(uid)) => {
            let is_it = |group: &Group| found.images[group.frames[0].image].series_uid == *uid;
            groups.iter().position(is_it).ok_or_else(|| {
                let problem = format!(
                    "found \"{uid}\", and none of the {count} volumes has that SeriesInstanceUID; \
                     see `isolume info`"
                );
                Fault::of("series", problem)
            })
        }
    }
}

/// A note that names the volumes which are not shown.
fn others(found: &Found, groups: &[Group], shown: usize) -> Vec<String> {
    let mut notes = Vec::new();
    let describe = |n: usize| {
        let image = &found.images[groups[n].frames[0].image];
        let modality = match image.modality.as_str() {
            "" => String::new(),
            modality => format!("{modality}, "),
        };
        let slices = match groups[n].frames.len() {
            1 => "1 slice".to_string(),
            count => format!("{count} slices"),
        };
        format!("{modality}{slices} of {}×{}", image.columns, image.rows)
    };
    if groups.len() > 1 {
        let rest = (0..groups.len()).filter(|n| *n != shown);
        let named = rest.take(MOST_NAMED);
        let named = named.map(|n| format!("{} (--set volume.series={})", describe(n), n + 1));
        let more = match groups.len().saturating_sub(1 + MOST_NAMED) {
            0 => String::new(),
            more => format!("; and {more} more, see `isolume info`"),
        };
        notes.push(format!(
            "there are {} volumes; this is number {}, {}; the others: {}{more}",
            groups.len(),
            shown + 1,
            describe(shown),
            named.collect::<Vec<_>>().join("; ")
        ));
    }
    if !found.others.is_empty() {
        notes.push(format!(
            "skipped, since not volumes: {}",
            found.counted_others()
        ));
    }
    notes
}

/// Facts that a user wants to know before trusting a volume.
fn facts(image: &Image, frames: &[(&Image, &Frame)]) -> Vec<(&'static str, String)> {
    let mut facts = vec![
        ("modality", image.modality.clone()),
        ("rescale", rescale(frames)),
    ];
    facts.extend(image.units.clone().map(|units| ("units", units)));
    facts
}

/// How values come of stored numbers: one rule for all slices, or, as in a PET, the range of the slopes.
fn rescale(frames: &[(&Image, &Frame)]) -> String {
    let rules = frames
        .iter()
        .map(|(_, frame)| (frame.slope, frame.intercept));
    let (slope, intercept) = (frames[0].1.slope, frames[0].1.intercept);
    if rules.clone().all(|rule| rule == (slope, intercept)) {
        return format!("{slope} · stored + {intercept}");
    }
    let slopes = rules.map(|(slope, _)| slope);
    let [low, high] = slopes.fold([slope; 2], |[low, high], slope| {
        [low.min(slope), high.max(slope)]
    });
    format!("differs from slice to slice, with slopes from {low} to {high}")
}
