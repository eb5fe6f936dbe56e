//! Tells volumes apart by the numbers of their instances alone.
//!
//! Moments of a heartbeat, directions of diffusion and the like are stated in many ways, some of which scanners misuse. So what
//! has the same number of frames at every place is that many volumes, in the order of their instances.
//!
//! A few places may have fewer frames: the scan was ended early, or a file was lost. Scanners count instances either volume by
//! volume or place by place; where the numbers are of one of these kinds, they say which volume lacks a slice.

use std::collections::BTreeMap;

use super::group::{At, Group};
use super::image::Image;
use super::stack::at_each_place;

/// The number of an instance, and of a frame in it.
type Number = (Option<i64>, usize);

/// The frames at a place by their numbers. Frames of one number are copies.
type Place = BTreeMap<Number, Vec<At>>;

/// The volumes of frames that repeat at each place; copies stay together.
pub fn by_repetition(images: &[Image], group: Group) -> Vec<Group> {
    let places = at_each_place(images, &group).unwrap_or_default();
    let places: Vec<Place> = places
        .into_iter()
        .map(|here| by_number(images, here))
        .collect();
    let count = places.iter().map(Place::len).max().unwrap_or(0);
    let Some(volume_of) = volumes_of(&places, count) else {
        return vec![group];
    };
    let mut volumes = vec![Group { frames: Vec::new() }; count];
    for (place, volume_of) in places.iter().zip(volume_of) {
        for (frames, volume) in place.values().zip(volume_of) {
            volumes[volume].frames.extend(frames);
        }
    }
    volumes
}

fn by_number(images: &[Image], frames: Vec<At>) -> Place {
    let mut place = Place::new();
    for at in frames {
        let number = (images[at.image].instance, at.frame);
        place.entry(number).or_default().push(at);
    }
    place
}

/// For each place the volume, of so many, to which each of its numbers belongs; `None` if these are not several volumes.
fn volumes_of(places: &[Place], count: usize) -> Option<Vec<Vec<usize>>> {
    let complete = places.iter().filter(|place| place.len() == count).count();
    if count < 2 {
        None
    } else if complete == places.len() {
        Some(vec![(0..count).collect(); complete])
    } else if 2 * complete > places.len() {
        let instances: Option<Vec<Vec<i64>>> = places.iter().map(instances).collect();
        let instances = instances?;
        let lowest = *instances.iter().flatten().min()?;
        // The very first slice may be the one that is missing; most scanners count from 1.
        [1, lowest]
            .into_iter()
            .find_map(|first| counted_from(&instances, first, count))
    } else {
        None
    }
}

/// The numbers of a place's instances, if each is one frame.
fn instances(place: &Place) -> Option<Vec<i64>> {
    let number = |(instance, frame): &Number| instance.filter(|_| *frame == 0);
    place.keys().map(number).collect()
}

/// The volume of each instance, if they are counted from `first` on, volume by volume or place by place.
fn counted_from(places: &[Vec<i64>], first: i64, count: usize) -> Option<Vec<Vec<usize>>> {
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
    let volumes = |volume: &dyn Fn(i64) -> i64| -> Option<Vec<Vec<usize>>> {
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
