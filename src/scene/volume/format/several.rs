//! Files with several values for each place: a scan at several times, or several channels, such as the components of a
//! vector.
//!
//! They follow one another as whole volumes, or side by side as the values of one voxel. One of them is the volume; of
//! whole volumes, only that one's bytes are read.

use std::path::Path;

use crate::scene::volume::overrides::VolumeOverrides;
use crate::scene::volume::parsed::{Fault, Keyed};
use crate::scene::volume::source::Source;
use crate::scene::volume::source::file::{Data, Encoding, Part};
use crate::scene::volume::source::interleaved::Interleaved;
use crate::scene::volume::storage::Storage;
use crate::scene::volume::voxel_type::VoxelType;

/// The key by which the user picks one of several values.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Key {
    Channel,
    Time,
}

use Key::*;

/// How many values there are for each place; each key occurs once at most.
#[derive(Debug, Default)]
pub struct Several {
    /// The values of a voxel that lie side by side.
    pub within: Option<(Key, u32)>,
    /// The whole volumes that follow one another, those nearest to each other first.
    pub beyond: Vec<(Key, u32)>,
}

/// Index of the channel, time or level of `count`, which is ≥ 1, that the user wants: the first by default.
pub fn pick(key: &'static str, wanted: Option<u32>, count: u32) -> Keyed<u32> {
    let wanted = wanted.unwrap_or(0);
    match (wanted < count, count) {
        (true, _) => Ok(wanted),
        (false, 1) => Err(Fault::of(
            key,
            format!("found {wanted}, expected 0: there is only one"),
        )),
        (false, _) => Err(Fault::of(
            key,
            format!("found {wanted}, expected 0 to {}", count - 1),
        )),
    }
}

impl Several {
    /// Opens the one that the user wants. `data` is where all of them are.
    pub fn open(
        &self,
        data: Data,
        header: &Path,
        dims: [u32; 3],
        voxel_type: VoxelType,
        overrides: &VolumeOverrides,
    ) -> Keyed<(Box<dyn Source>, Storage)> {
        let storage = self.storage(data.encoding, overrides)?;
        let index = |key| match key {
            Channel => storage.channel.unwrap_or(0),
            Time => storage.time.unwrap_or(0),
        };
        let mut part = Part::WHOLE;
        for &(key, size) in &self.beyond {
            let beyond = || "holds more volumes than can be counted".to_string();
            let of = part.of.checked_mul(size.into()).ok_or_else(beyond)?;
            part.index += part.of * u64::from(index(key));
            part.of = of;
        }
        let data = Data { part, ..data };
        let source = match self.within {
            None => data.open(header, dims, voxel_type)?,
            Some((key, count)) => {
                let [x, y, z] = dims;
                let long = || format!("a row of {x} voxels with {count} values each is too long");
                let all = [x.checked_mul(count).ok_or_else(long)?, y, z];
                Box::new(Interleaved {
                    source: data.open(header, all, voxel_type)?,
                    count,
                    picked: index(key),
                    value_bytes: voxel_type.bytes(),
                })
            }
        };
        Ok((source, storage))
    }

    /// The storage that users are told about, with the indices of the values that they want.
    fn storage(&self, encoding: Encoding, overrides: &VolumeOverrides) -> Keyed<Storage> {
        let count = |key| self.count(key).unwrap_or(1);
        let channel = pick("channel", overrides.channel, count(Channel))?;
        let time = pick("time", overrides.time, count(Time))?;
        Ok(Storage {
            channels: self.count(Channel).unwrap_or(0),
            channel: self.count(Channel).map(|_| channel),
            times: self.count(Time).unwrap_or(0),
            time: self.count(Time).map(|_| time),
            ..encoding.storage()
        })
    }

    /// How many values there are to pick from by a key, if there is more than one.
    fn count(&self, wanted: Key) -> Option<u32> {
        let mut all = self.within.iter().chain(&self.beyond);
        all.find(|(key, _)| *key == wanted).map(|(_, count)| *count)
    }
}
