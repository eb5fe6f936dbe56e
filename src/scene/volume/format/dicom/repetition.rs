//! Tells apart volumes that repeat at each place and are alike in what `series.rs` looks at.
//!
//! Moments of a heartbeat, directions of diffusion and the like are stated in many ways, some of which scanners misuse. So what
//! has the same number of frames at every place is that many volumes. Which frame belongs to which is said by the first of
//! these that tells them apart cleanly: a quantity of the scanner's setting that has one value in each volume; the numbers of
//! instances, if these are counted volume by volume; a quantity, and then the time of acquisition, whose ranges in the volumes
//! do not meet; and numbers that are counted place by place. What only differs among the frames of each place comes last,
//! since it may be noise: their times, and then their instances, in order.
//!
//! A few places may have fewer frames: the scan was ended early, or a file was lost. What tells volumes apart cleanly then says
//! which of them lacks a slice.

use std::collections::{BTreeMap, BTreeSet};

use super::group::{At, Group, frame};
use super::image::Image;
use super::setting::{QUANTITIES, Setting};
use super::stack::at_each_place;

/// What tells a frame from a copy of it.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
struct Key<'a> {
    instance: Option<i64>,
    /// In its file.
    frame: usize,
    setting: &'a Setting,
    acquired: &'a str,
}

/// The frames at a place; those of one key are copies.
type Place<'a> = BTreeMap<Key<'a>, Vec<At>>;

/// For each place the volume to which each of its keys belongs.
type Volumes = Vec<Vec<usize>>;

/// The volumes of frames that repeat at each place; copies stay together.
pub fn by_repetition(images: &[Image], group: Group) -> Vec<Group> {
    let places = at_each_place(images, &group).unwrap_or_default();
    let by_key = |here| by_key(images, here);
    let places: Vec<Place> = places.into_iter().map(by_key).collect();
    let count = places.iter().map(Place::len).max().unwrap_or(0);
    let Some(volumes) = volumes_of(&places, count) else {
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

fn by_key(images: &[Image], frames: Vec<At>) -> Place<'_> {
    let mut place = Place::new();
    for at in frames {
        let of = frame(images, at);
        let key = Key {
            instance: images[at.image].instance,
            frame: at.frame,
            setting: &of.setting,
            acquired: &of.acquired,
        };
        place.entry(key).or_default().push(at);
    }
    place
}

/// `None` if these are not so many volumes, or nothing tells them apart.
fn volumes_of(places: &[Place], count: usize) -> Option<Volumes> {
    if count < 2 {
        return None;
    }
    let all = Frames { places, count };
    let quantities = 0..QUANTITIES.len();
    let by_setting = || {
        (quantities.clone())
            .find_map(|n| all.by_one_value(|key| key.setting.number(n)))
            .or_else(|| all.by_one_value(|key| key.setting))
    };
    let by_range = || {
        (quantities.clone())
            .find_map(|n| all.by_one_range(|key| key.setting.number(n)))
            .or_else(|| all.by_one_range(|key| key.acquired))
    };
    let by_order = || match (all.counted_by_volume(), by_range()) {
        // Instances may be counted backwards.
        (Some(counted), Some(ranged)) if are_alike(&counted, &ranged) => Some(ranged),
        (counted, ranged) => counted
            .or(ranged)
            .or_else(|| all.counted_by_place())
            .or_else(|| all.ranked(|key| key.acquired))
            .or_else(|| all.ranked(|key| (key.instance, key.frame))),
    };
    by_setting().or_else(|| all.are_repeated().then(by_order).flatten())
}

/// Whether the same frames are of one volume, whatever its number is.
fn are_alike(a: &Volumes, b: &Volumes) -> bool {
    let pairs = a.iter().flatten().zip(b.iter().flatten());
    let pairs = BTreeSet::from_iter(pairs);
    let firsts: BTreeSet<_> = pairs.iter().map(|(a, _)| a).collect();
    let seconds: BTreeSet<_> = pairs.iter().map(|(_, b)| b).collect();
    pairs.len() == firsts.len() && pairs.len() == seconds.len()
}

/// Frames of so many volumes.
struct Frames<'a> {
    places: &'a [Place<'a>],
    count: usize,
}

impl<'a> Frames<'a> {
    /// Whether they may be volumes of which some lack slices. A few slices may also have been taken twice.
    fn are_repeated(&self) -> bool {
        let is_whole = |place: &&Place| place.len() == self.count;
        let whole = self.places.iter().filter(is_whole).count();
        2 * whole > self.places.len() || self.places.iter().all(|place| place.len() > 1)
    }

    fn values<V>(&self, value: impl Fn(&Key<'a>) -> V) -> Vec<Vec<V>> {
        let places = self.places.iter();
        let values = |place: &Place<'a>| place.keys().map(&value).collect();
        places.map(values).collect()
    }

    /// By a value that is the same within each volume, and another in each.
    fn by_one_value<V: Ord>(&self, value: impl Fn(&Key<'a>) -> V) -> Option<Volumes> {
        let values = self.values(value);
        let known = sorted(values.iter().flatten());
        let volume = |value: &V| known.binary_search(&value).ok();
        let volumes = values.iter().map(|here| distinct(here, volume));
        (known.len() == self.count).then(|| volumes.collect())?
    }

    /// By a value whose range in a volume, over all whole places, meets that of no other.
    fn by_one_range<V: Ord>(&self, value: impl Fn(&Key<'a>) -> V) -> Option<Volumes> {
        let values = self.values(value);
        let mut ranges: Vec<[&V; 2]> = Vec::new();
        for here in values.iter().filter(|here| here.len() == self.count) {
            let here = sorted(here);
            if ranges.is_empty() {
                ranges = here.iter().map(|value| [*value; 2]).collect();
            }
            // Where two frames have the same value there are too few.
            for ([low, high], value) in ranges.iter_mut().zip(&here) {
                (*low, *high) = ((*low).min(value), (*high).max(value));
            }
        }
        let are_apart =
            ranges.len() == self.count && ranges.windows(2).all(|pair| pair[0][1] < pair[1][0]);
        let is_in = |value: &V| {
            ranges
                .iter()
                .position(|[low, high]| *low <= value && value <= *high)
        };
        let volumes = values.iter().map(|here| distinct(here, is_in));
        are_apart.then(|| volumes.collect())?
    }

    /// By the order of a value, if all places are whole.
    fn ranked<V: Ord>(&self, value: impl Fn(&Key<'a>) -> V) -> Option<Volumes> {
        let ranked = |here: &Vec<V>| {
            let known = sorted(here);
            let volumes = distinct(here, |value| known.binary_search(&value).ok());
            volumes.filter(|volumes| volumes.len() == self.count)
        };
        self.values(value).iter().map(ranked).collect()
    }

    /// By the numbers of instances that are counted volume by volume.
    fn counted_by_volume(&self) -> Option<Volumes> {
        let slices = self.places.len() as i64;
        self.counted(|here| {
            Some(
                here.iter()
                    .map(|number| number.div_euclid(slices))
                    .collect(),
            )
        })
    }

    /// By the numbers of instances that are counted place by place.
    fn counted_by_place(&self) -> Option<Volumes> {
        let count = self.count as i64;
        self.counted(|here| {
            let place = here[0].div_euclid(count);
            let is_here = |number: &i64| number.div_euclid(count) == place;
            let volumes = here.iter().map(|number| number.rem_euclid(count));
            here.iter().all(is_here).then(|| volumes.collect())
        })
    }

    /// By the numbers of instances, if each is one frame: `volumes` tells which volumes those of a place are of, where they are
    /// counted from 0.
    fn counted(&self, volumes: impl Fn(&[i64]) -> Option<Vec<i64>>) -> Option<Volumes> {
        let instances = self.values(|key| key.instance.filter(|_| key.frame == 0));
        let numbers = |here: Vec<Option<i64>>| here.into_iter().collect();
        let instances: Option<Vec<Vec<i64>>> = instances.into_iter().map(numbers).collect();
        let instances = instances?;
        let lowest = *instances.iter().flatten().min()?;
        let counted_from = |first: i64| -> Option<Volumes> {
            let of_place = |here: &Vec<i64>| {
                // A damaged file may state any number.
                let here: Vec<i64> = here
                    .iter()
                    .map(|number| number.saturating_sub(first))
                    .collect();
                let exists =
                    |volume: &i64| usize::try_from(*volume).ok().filter(|&n| n < self.count);
                distinct(&volumes(&here)?, exists)
            };
            instances.iter().map(of_place).collect()
        };
        // The very first slice may be the one that is missing; most scanners count from 1.
        counted_from(1).or_else(|| counted_from(lowest))
    }
}

/// Values without repetitions, in their order.
fn sorted<'v, V: Ord>(values: impl IntoIterator<Item = &'v V>) -> Vec<&'v V> {
    BTreeSet::from_iter(values).into_iter().collect()
}

/// The volume of each value at a place; `None` if a volume is that of several, or one has none.
fn distinct<V>(here: &[V], volume: impl Fn(&V) -> Option<usize>) -> Option<Vec<usize>> {
    let volumes: Option<Vec<usize>> = here.iter().map(volume).collect();
    let are_distinct = |volumes: &Vec<usize>| sorted(volumes).len() == volumes.len();
    volumes.filter(are_distinct)
}
