//! Groups frames into volumes.
//!
//! A series is a technician's choice, and may hold several volumes and images made on the way to them. Frames belong
//! to one volume if series, size, voxel size, orientation, image type and acquisition are the same, and also echo,
//! time, b-value and stack where a file states them.
//!
//! Some scanners state another echo, time, b-value, stack or image type for each slice, or for one of them. Such slices
//! are one volume if they lie at equal distances and not more than one of these parts has several slices. So are parts of
//! which each begins where another ends, as those of a head with thin slices below and thick ones above.
//!
//! Some scanners count an acquisition for each slice, or for each few slices between two steps of the table. Where
//! acquisitions continue one another, or each has only one slice, their numbers do not distinguish volumes, and are
//! ignored.
//!
//! What is left may still repeat at each place (`repetition.rs`).

use std::collections::HashMap;

use super::frame::{Frame, Kind};
use super::group::{At, Group, frame};
use super::image::Image;
use super::repetition::by_repetition;
use super::stack::{is_continued, is_even};

/// Differences of direction cosines, and relative differences of voxel sizes, that count as rounding.
const ROUNDING: f64 = 1e-3;

/// What tells the volumes of one series apart that have the same size and directions.
#[derive(Debug, Clone, Copy, PartialEq)]
enum Tell {
    Nothing,
    /// Image type, echo, time, b-value and stack.
    Kind,
    Acquisition,
}

/// Properties that must be the same within a volume, apart from directions and voxel sizes.
#[derive(Debug, Clone, PartialEq, Eq, Hash)]
struct Key<'a> {
    series: &'a str,
    modality: &'a str,
    size: [u32; 2],
    kind: Option<(&'a str, &'a Kind)>,
    acquisition: Option<&'a str>,
    /// Set for a frame without a position in the patient, which belongs to no other frames.
    alone: Option<(usize, usize)>,
}

/// The volumes, the largest first, and those of one series in the order of what tells them apart.
pub fn group(images: &[Image]) -> Vec<Group> {
    let frames =
        |image: usize| (0..images[image].frames.len()).map(move |frame| At { image, frame });
    let all = (0..images.len()).flat_map(frames).collect();
    let alike = split(images, all, Tell::Nothing).into_iter();
    let mut groups: Vec<Group> = alike
        .flat_map(|group| by_kind(images, group))
        .flat_map(|group| by_acquisition(images, group))
        .flat_map(|group| by_repetition(images, group))
        .collect();
    let order = |group: &Group| {
        let image = &images[group.frames[0].image];
        let voxels = image.frame_pixels() * group.frames.len() as u64;
        (
            std::cmp::Reverse(voxels),
            image.series_number,
            image.series_uid.clone(),
            frame(images, group.frames[0]).order(),
        )
    };
    groups.sort_by_cached_key(order);
    groups
}

fn kind(frame: &Frame) -> (&str, &Kind) {
    (&frame.image_type, &frame.kind)
}

fn acquisition(frame: &Frame) -> &str {
    &frame.acquisition
}

/// The volumes of frames that have the same series, size and directions.
fn by_kind(images: &[Image], group: Group) -> Vec<Group> {
    // Two slices are at equal distances wherever they lie.
    const FEWEST: usize = 3;
    let kinds = split(images, group.frames.clone(), Tell::Kind);
    let several = kinds.iter().filter(|kind| kind.frames.len() > 1).count();
    let may_be_one = kinds.len() > 1 && several <= 1 && group.frames.len() >= FEWEST;
    let may_be_continued = several > 1 && several == kinds.len();
    if may_be_one && is_even(images, &group)
        || may_be_continued && is_continued(images, &group, kind, false)
    {
        vec![group]
    } else {
        kinds
    }
}

/// The volumes of frames that differ in nothing but their acquisitions.
fn by_acquisition(images: &[Image], group: Group) -> Vec<Group> {
    // Each may have every second slice, say.
    if is_continued(images, &group, acquisition, true) {
        return vec![group];
    }
    let acquisitions = split(images, group.frames, Tell::Acquisition).into_iter();
    let (mut volumes, single): (Vec<Group>, Vec<Group>) =
        acquisitions.partition(|group| group.frames.len() > 1);
    let frames: Vec<At> = single.into_iter().flat_map(|group| group.frames).collect();
    volumes.extend((!frames.is_empty()).then_some(Group { frames }));
    volumes
}

fn split(images: &[Image], frames: Vec<At>, tell: Tell) -> Vec<Group> {
    let mut groups: Vec<Group> = Vec::new();
    let mut known: HashMap<Key, Vec<usize>> = HashMap::new();
    for at in frames {
        let image = &images[at.image];
        let this = frame(images, at);
        let key = Key {
            series: &image.series_uid,
            modality: &image.modality,
            size: [image.columns, image.rows],
            kind: (tell == Tell::Kind).then(|| kind(this)),
            acquisition: (tell == Tell::Acquisition).then(|| acquisition(this)),
            alone: this.plane.is_none().then_some((at.image, at.frame)),
        };
        let candidates = known.entry(key).or_default();
        let is_alike = |n: &&usize| are_alike(frame(images, groups[**n].frames[0]), this);
        match candidates.iter().find(is_alike) {
            Some(n) => groups[*n].frames.push(at),
            None => {
                candidates.push(groups.len());
                groups.push(Group { frames: vec![at] });
            }
        }
    }
    groups
}

/// Whether directions and voxel sizes are the same.
fn are_alike(a: &Frame, b: &Frame) -> bool {
    let has_same_size = match (a.pixel_spacing, b.pixel_spacing) {
        (Some(a), Some(b)) => (0..2).all(|n| (a[n] - b[n]).abs() <= ROUNDING * a[n].abs()),
        (None, None) => true,
        _ => false,
    };
    let has_same_directions = match (&a.plane, &b.plane) {
        (Some(a), Some(b)) => {
            let mut directions = a.along.iter().zip(b.along);
            a.is_in_patient == b.is_in_patient
                && directions.all(|(a, b)| (a - b).abs().max_element() <= ROUNDING)
        }
        (None, None) => true,
        _ => false,
    };
    has_same_size && has_same_directions
}
