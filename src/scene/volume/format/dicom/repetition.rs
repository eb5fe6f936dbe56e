//! Tells apart volumes that repeat at each place and are alike in what `series.rs` looks at.
//!
//! Moments of a heartbeat, directions of diffusion and the like are stated in many ways, some of which scanners misuse. So what
//! has the same number of frames at every place is that many volumes. Which frame belongs to which is said by the first of
//! these that differs among all frames of a place: how the scanner was set, when they were taken, or the numbers of their
//! instances.
//!
//! A few places may have fewer frames: the scan was ended early, or a file was lost. Settings that are the same at all places
//! then say which volume lacks a slice. So do numbers of instances, which scanners count either volume by volume or place by
//! place.

use std::collections::{BTreeMap, BTreeSet};

use super::group::{At, Group, frame};
use super::image::Image;
use super::stack::at_each_place;

/// The number of an instance, and of a frame in it.
type Number = (Option<i64>, usize);

/// The frames at a place by their numbers. Frames of one number are copies.
type Place = BTreeMap<Number, Vec<At>>;

/// For each place the volume to which each of its numbers belongs.
type Volumes = Vec<Vec<usize>>;

/// The volumes of frames that repeat at each place; copies stay together.
pub fn by_repetition(images: &[Image], group: Group) -> Vec<Group> {
    let places = at_each_place(images, &group).unwrap_or_default();
    let places: Vec<Place> = places
        .into_iter()
        .map(|here| by_number(images, here))
        .collect();
    let count = places.iter().map(Place::len).max().unwrap_or(0);
    let complete = places.iter().filter(|place| place.len() == count).count();
    if count < 2 || 2 * complete <= places.len() {
        return vec![group];
    }
    let volumes = by_value(&places, count, |at| &frame(images, at).setting)
        .or_else(|| by_value(&places, count, |at| &frame(images, at).acquired))
        .or_else(|| by_instance(&places, count));
    let Some(volumes) = volumes else {
        return vec![group];
    };
    let mut groups = vec![Group { frames: Vec::new() }; count];
    for (place, volumes) in places.iter().zip(volumes) {
        for (frames, volume) in place.values().zip(volumes) {
            groups[volume].frames.extend(frames);
        }
    }
    groups
}

fn by_number(images: &[Image], frames: Vec<At>) -> Place {
    let mut place = Place::new();
    for at in frames {
        let number = (images[at.image].instance, at.frame);
        place.entry(number).or_default().push(at);
    }
    place
}

/// By a value that differs among all frames of a place: either each volume has one value, or each place has all volumes,
/// and the order of its values is that of volumes.
fn by_value<'a, V: Ord + 'a>(
    places: &[Place],
    count: usize,
    value: impl Fn(At) -> &'a V,
) -> Option<Volumes> {
    let values_of = |place: &Place| place.values().map(|frames| value(frames[0])).collect();
    let values: Vec<Vec<&V>> = places.iter().map(values_of).collect();
    let all: BTreeSet<&V> = values.iter().flatten().copied().collect();
    let one_each = (all.len() == count).then_some(all);
    let volumes_of = |here: &Vec<&V>| {
        let own: BTreeSet<&V> = here.iter().copied().collect();
        let told = own.len() == here.len() && (one_each.is_some() || own.len() == count);
        let among: Vec<&V> = one_each.clone().unwrap_or(own).into_iter().collect();
        let volume = |value: &&V| among.binary_search(value).ok();
        told.then(|| here.iter().map(volume).collect()).flatten()
    };
    values.iter().map(volumes_of).collect()
}

/// By the numbers of instances, in their order.
fn by_instance(places: &[Place], count: usize) -> Option<Volumes> {
    if places.iter().all(|place| place.len() == count) {
        return Some(vec![(0..count).collect(); places.len()]);
    }
    let instances: Option<Vec<Vec<i64>>> = places.iter().map(instances).collect();
    let instances = instances?;
    let lowest = *instances.iter().flatten().min()?;
    // The very first slice may be the one that is missing; most scanners count from 1.
    [1, lowest]
        .into_iter()
        .find_map(|first| counted_from(&instances, first, count))
}

/// The numbers of a place's instances, if each is one frame.
fn instances(place: &Place) -> Option<Vec<i64>> {
    let number = |(instance, frame): &Number| instance.filter(|_| *frame == 0);
    place.keys().map(number).collect()
}

/// The volume of each instance, if they are counted from `first` on, volume by volume or place by place.
fn counted_from(places: &[Vec<i64>], first: i64, count: usize) -> Option<Volumes> {
    let (slices, count) = (places.len() as i64, count as i64);
    // A damaged file may state any number.
    let counted = |number: i64| number.saturating_sub(first);
    let volume_by_volume = |number: i64| counted(number).div_euclid(slices);
    let place_by_place = |number: i64| counted(number).rem_euclid(count);
    let place_of = |number: i64| counted(number).div_euclid(count);
    let is_of_one_place = |numbers: &Vec<i64>| {
        numbers
            .iter()
            .all(|number| place_of(*number) == place_of(numbers[0]))
    };
    let volumes = |volume: &dyn Fn(i64) -> i64| -> Option<Volumes> {
        let of_place = |numbers: &Vec<i64>| {
            let volumes: Vec<i64> = numbers.iter().map(|number| volume(*number)).collect();
            let are_several = volumes.is_sorted_by(|a, b| a < b);
            let exist = volumes.iter().all(|volume| (0..count).contains(volume));
            let volumes = volumes.into_iter().map(|volume| volume as usize);
            (are_several && exist).then(|| volumes.collect())
        };
        places.iter().map(of_place).collect()
    };
    volumes(&volume_by_volume).or_else(|| {
        let are_places = places.iter().all(is_of_one_place);
        are_places.then(|| volumes(&place_by_place)).flatten()
    })
}
