//! Merges shards into one picture: `isolume merge`.
//!
//! Shards are folded in order of their samples, so that the result does not depend on the order of the arguments; in
//! double precision, by the formulas of Chan, Golub and LeVeque (1979), so that it equals that of a single run apart
//! from rounding, except for how evenly marched samples are spread: where the second of two folded shards does not double
//! the samples of the first, samples count as spread evenly within each shard only.

use std::path::{Path, PathBuf};
use std::sync::Arc;

use super::checkpoint::State;
use super::file::{Pixels, read_header};
use super::header::{Fill, Header, checksum};
use super::identity::Named;
use crate::engine::{Picture, SampleRange};
use crate::error::{Error, Location, Result};
use crate::render::{Halves, Sums, variance};

/// The picture of all shards.
pub struct Merged {
    pub picture: Picture,
    pub sums: Sums,
    pub header: Header,
    /// The resolved scene of the shard with the first samples.
    pub scene: String,
    /// Remarks for the user: one sentence each.
    pub notes: Vec<String>,
}

/// A file with samples of the picture.
struct Shard<'a> {
    path: &'a Path,
    name: String,
    header: Header,
    scene: String,
}

/// Merges shards.
///
/// # Errors
///
/// If there is no file, if one is no shard or is damaged, if two are of different pictures, or if two hold the same
/// samples.
pub fn merge(paths: &[PathBuf]) -> Result<Merged> {
    let mut shards = paths
        .iter()
        .map(|path| Shard::open(path))
        .collect::<Result<Vec<_>>>()?;
    shards.sort_by_key(|shard| shard.header.samples[0]);
    let Some((first, others)) = shards.split_first() else {
        return Err(Error::Usage("there are no shards to merge".into()));
    };
    for shard in others {
        if let Some(difference) = first.named().difference(&shard.named())? {
            return Err(Error::input(
                Location::file(&shard.name),
                format!("it is of another picture than {}: {difference}", first.name),
            ));
        }
    }
    let samples = joined(&shards)?;
    let (picture, sums) = fold(first, others)?;
    let mut header = Header {
        samples,
        units: shards.iter().map(|shard| shard.header.units).sum(),
        paths: shards
            .iter()
            .map(|shard| shard.header.paths)
            .fold(0, u64::saturating_add),
        lookups: shards
            .iter()
            .map(|shard| shard.header.lookups)
            .fold(0, u64::saturating_add),
        halves: sums.halves.as_ref().map(|halves| halves.samples),
        fills: fills(&shards),
        devices: Vec::new(),
        checksum: checksum(&sums),
        identity: first.header.identity.clone(),
    };
    for device in shards.iter().flat_map(|shard| &shard.header.devices) {
        if !header.devices.contains(device) {
            header.devices.push(device.clone());
        }
    }
    let stderr = sums.standard_error(header.count(), header.units, header.cache_error());
    Ok(Merged {
        picture: Picture { stderr, ..picture },
        sums,
        notes: notes(&header),
        header,
        scene: first.scene.clone(),
    })
}

/// Fails if the output would take the place of a checkpoint, or of a shard of the same picture whose samples are not in the
/// merged one, as where its name was forgotten and the first shard stands in its place.
pub fn check_kept(output: &Path, merged: &Header) -> Result<()> {
    if read_header::<State>(output).is_ok() {
        let problem = "it is a checkpoint, and a merged picture in its place could not be continued; name another file";
        return Err(Error::input(output, problem));
    }
    let Ok((before, _)) = read_header::<Header>(output) else {
        return Ok(());
    };
    let is_in = |range: &SampleRange| {
        let mut all = merged.samples.iter();
        all.any(|merged| merged.first <= range.first && range.end <= merged.end)
    };
    let lost = before.samples.iter().find(|range| !is_in(range));
    match lost.filter(|_| before.identity == merged.identity) {
        Some(range) => Err(Error::input(
            output,
            format!(
                "it holds the samples {range} of this picture, which would be lost: name the file to write first, and then all shards"
            ),
        )),
        None => Ok(()),
    }
}

impl<'a> Shard<'a> {
    fn open(path: &'a Path) -> Result<Shard<'a>> {
        let (header, scene): (Header, String) = read_header(path)?;
        let name = path.display().to_string();
        header
            .check()
            .map_err(|why| Error::input(Location::file(&name), why))?;
        if header.samples.is_empty() {
            return Err(Error::input(
                Location::file(name),
                "it holds no samples yet",
            ));
        }
        Ok(Shard {
            path,
            name,
            header,
            scene,
        })
    }

    fn named(&self) -> Named<'_> {
        Named {
            name: &self.name,
            identity: &self.header.identity,
            scene: &self.scene,
        }
    }
}

/// The samples of all shards; ranges that touch become one.
fn joined(shards: &[Shard<'_>]) -> Result<Vec<SampleRange>> {
    let ranges = |shard: &'_ Shard<'_>| shard.header.samples.clone();
    let mut all: Vec<(SampleRange, &str)> = shards
        .iter()
        .flat_map(|shard| {
            ranges(shard)
                .into_iter()
                .map(|range| (range, &shard.name[..]))
        })
        .collect();
    all.sort();
    let mut joined: Vec<(SampleRange, &str)> = Vec::new();
    for (range, name) in all {
        match joined.last_mut() {
            Some((last, before)) if range.first < last.end => {
                let common = SampleRange {
                    first: range.first,
                    end: range.end.min(last.end),
                };
                return Err(Error::input(
                    Location::file(name),
                    format!(
                        "it holds the samples {common}, as does {before}: each may be merged only once"
                    ),
                ));
            }
            Some((last, before)) if range.first == last.end => {
                (last.end, *before) = (range.end, name);
            }
            _ => joined.push((range, name)),
        }
    }
    Ok(joined.into_iter().map(|(range, _)| range).collect())
}

/// The mean of all samples, and the spread of all units around it. Everything else is that of the first shard.
fn fold(first: &Shard<'_>, others: &[Shard<'_>]) -> Result<(Picture, Sums)> {
    let Pixels { mut picture, sums } = Pixels::read(first.path, &first.header)?;
    let [width, _] = first.header.identity.size;
    let (mut count, mut units) = (f64::from(first.header.count()), first.header.units);
    let mut halves = sums.halves;
    let (mut mean, mut squares) = (double(&sums.mean), double(&sums.squares));
    for shard in others {
        let Pixels { sums, .. } = Pixels::read(shard.path, &shard.header)?;
        let more = f64::from(shard.header.count());
        let all = count + more;
        // Of few samples nothing is known; they count as independent.
        let unknown = |samples: f64, mean| Arc::new(Halves::first(samples as u32, mean));
        let both = match (halves, sums.halves) {
            (None, None) => None,
            (before, added) => Some((
                before.unwrap_or_else(|| unknown(count, single(&mean))),
                added.unwrap_or_else(|| unknown(more, sums.mean.clone())),
            )),
        };
        let texels = sums.mean.iter().zip(&sums.squares);
        for ((m, s), (m_shard, s_shard)) in mean.iter_mut().zip(&mut squares).zip(texels) {
            for c in 0..4 {
                let difference = f64::from(m_shard[c]) - m[c];
                m[c] += difference * (more / all);
                s[c] += f64::from(s_shard[c]) + difference * difference * (count * more / all);
            }
        }
        units += shard.header.units;
        halves = both.map(|(before, added)| {
            let mean = single(&mean);
            Arc::new(if all == f64::from(before.samples) * 2.0 {
                let variance = variance(&single(&squares), all as u32, units);
                before.doubled(mean, &variance, width as usize)
            } else {
                before.joined(count, &added, more, mean)
            })
        });
        count = all;
    }
    let sums = Sums {
        mean: single(&mean),
        squares: single(&squares),
        halves,
    };
    picture.show(&sums.mean);
    Ok((picture, sums))
}

fn double(texels: &[[f32; 4]]) -> Vec<[f64; 4]> {
    texels.iter().map(|texel| texel.map(f64::from)).collect()
}

fn single(texels: &[[f64; 4]]) -> Vec<[f32; 4]> {
    texels.iter().map(|texel| texel.map(|x| x as f32)).collect()
}

/// All fillings, each once.
fn fills(shards: &[Shard<'_>]) -> Vec<Fill> {
    let mut fills: Vec<Fill> = Vec::new();
    for fill in shards.iter().flat_map(|shard| &shard.header.fills) {
        match fills.iter_mut().find(|other| other.id == fill.id) {
            Some(other) => other.samples = other.samples.saturating_add(fill.samples),
            None => fills.push(fill.clone()),
        }
    }
    fills
}

fn notes(header: &Header) -> Vec<String> {
    let mut notes = Vec::new();
    let ends = [SampleRange { first: 0, end: 0 }];
    let ranges: Vec<SampleRange> = ends.into_iter().chain(header.samples.clone()).collect();
    for pair in ranges.windows(2).filter(|pair| pair[0].end < pair[1].first) {
        notes.push(format!(
            "the samples {}..{} are in none of the files",
            pair[0].end, pair[1].first
        ));
    }
    if header.devices.len() > 1 {
        notes.push(format!(
            "the shards were rendered on different devices or drivers, whose rounding differs: {}",
            header.devices.join("; ")
        ));
    }
    if header.fills.len() > 1 {
        notes.push(format!(
            "the shards read {} fillings of the cache, which share their seed: so their errors count as common to all \
             samples",
            header.fills.len()
        ));
    }
    notes
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn no_shards_make_no_picture() {
        let error = merge(&[]).err().expect("an error");
        assert!(matches!(error, Error::Usage(_)), "{error}");
    }
}
