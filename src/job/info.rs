//! `isolume info`: what a device can do, or what is in a volume.

use std::collections::BTreeMap;
use std::path::Path;

use serde::Serialize;

use super::print;
use crate::bytes::human;
use crate::cli::InfoArgs;
use crate::error::{Error, Result};
use crate::gpu::{DeviceSummary, list_devices};
use crate::output::to_json;
use crate::scene::volume::{Level, MOST_NAMES, Series, Storage, Volume};
use crate::scene::{Edit, bare_volume};

/// Bars of the histogram.
const BINS: usize = 16;

/// `isolume info`.
pub fn info(args: &InfoArgs) -> Result<u8> {
    match &args.volume {
        Some(path) => {
            let described = volume(path, &args.set, args.json)?;
            print(&described.text)?;
            described.fault.map_or(Ok(0), Err)
        }
        None => print(&devices(args.json)?),
    }
}

/// What was found out about a volume, and the error if that is not all.
struct Description {
    text: String,
    fault: Option<Error>,
}

#[derive(Serialize)]
struct SeriesInfo<'a> {
    series: &'a [Series],
}

#[derive(Serialize)]
struct VolumeInfo {
    /// Only present for a format that may hold several volumes.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    series: Vec<Series>,
    /// What else the file says.
    #[serde(flatten)]
    facts: BTreeMap<&'static str, String>,
    #[serde(flatten)]
    storage: StorageInfo,
    dims: [u32; 3],
    #[serde(rename = "type")]
    voxel_type: String,
    spacing: [f64; 3],
    range: [f64; 2],
    /// Where i, j and k grow; `None`: unknown.
    orientation: Option<String>,
    /// The letters in a sentence.
    #[serde(skip_serializing_if = "Option::is_none")]
    growth: Option<String>,
    histogram: Vec<Bin>,
    notes: Vec<String>,
}

/// How the file stores the volume.
#[derive(Serialize)]
struct StorageInfo {
    format: &'static str,
    compression: Option<String>,
    unit: Option<String>,
    /// Names of the channels, or "" for those that have none.
    channels: Vec<String>,
    times: u32,
    levels: Vec<Level>,
    channel: Option<u32>,
    time: Option<u32>,
    level: Option<u32>,
    /// The same for people.
    #[serde(skip)]
    lines: Vec<(&'static str, String)>,
}

impl From<Storage> for StorageInfo {
    fn from(storage: Storage) -> StorageInfo {
        let lines = storage.lines();
        let named = storage.channel_names.into_iter();
        let names = named.chain(std::iter::repeat(String::new()));
        StorageInfo {
            lines,
            channels: names
                .take(storage.channels.min(MOST_NAMES) as usize)
                .collect(),
            format: storage.format,
            compression: storage.compression,
            unit: storage.unit,
            times: storage.times,
            levels: storage.levels,
            channel: storage.channel,
            time: storage.time,
            level: storage.level,
        }
    }
}

#[derive(Serialize)]
struct Bin {
    low: f64,
    high: f64,
    voxels: u64,
}

/// Describes the volume that `edits` pick, as text or JSON. If it cannot be loaded, the other volumes of its folder are listed
/// all the same.
fn volume(path: &Path, edits: &[Edit], json: bool) -> Result<Description> {
    let bare = bare_volume(path, edits)?;
    let overrides = bare.volume_overrides()?;
    let series = Volume::series(path)?;
    let volume = match Volume::load(path, &overrides).map_err(|error| bare.at_its_key(error)) {
        Ok(volume) => volume,
        Err(fault) if series.is_empty() => return Err(fault),
        Err(fault) => {
            let text = if json {
                to_json(&SeriesInfo { series: &series })?
            } else {
                series_table(&series)
            };
            let fault = Some(fault);
            return Ok(Description { text, fault });
        }
    };
    let histogram = volume.histogram(BINS)?;
    let bins = histogram.counts.iter().enumerate().map(|(i, &voxels)| Bin {
        low: histogram.low + i as f64 * histogram.width,
        high: histogram.low + (i + 1) as f64 * histogram.width,
        voxels,
    });
    let info = VolumeInfo {
        series,
        facts: volume.facts.iter().cloned().collect(),
        storage: volume.storage.into(),
        dims: volume.dims,
        voxel_type: volume.voxel_type.to_string(),
        spacing: volume.spacing,
        range: volume.range,
        orientation: volume.axes.map(|axes| axes.to_string()),
        growth: volume.axes.map(|axes| {
            let [x, y, z] = axes.0.map(|direction| direction.name());
            let turned = match volume.file_axes {
                Some(file_axes) if file_axes != axes => {
                    format!("; {file_axes} in the file, whose slowest axis is reversed")
                }
                _ => String::new(),
            };
            format!("x grows towards {x}, y towards {y}, z towards {z}{turned}")
        }),
        histogram: bins.collect(),
        notes: volume.notes,
    };
    let text = if json { to_json(&info)? } else { info.table() };
    Ok(Description { text, fault: None })
}

/// A line for each volume, and one for each note on it.
fn series_table(series: &[Series]) -> String {
    let mut text = String::new();
    for one in series {
        let ([x, y, z], [a, b, c]) = (one.dims, one.spacing);
        text += &format!(
            "series {:<3} {:<4} {} slices, {x} × {y} × {z} of {a} × {b} × {c}  {}  {}\n",
            one.number, one.modality, one.slices, one.description, one.uid
        );
        for note in &one.notes {
            text += &format!("           {note}\n");
        }
    }
    text
}

impl VolumeInfo {
    fn table(&self) -> String {
        let [x, y, z] = self.dims;
        let [a, b, c] = self.spacing;
        let orientation = self.orientation.as_deref().unwrap_or("unknown");
        let mut text = series_table(&self.series);
        let storage = self.storage.lines.iter().map(|(name, line)| (*name, line));
        let facts = self.facts.iter().map(|(name, fact)| (*name, fact));
        for (name, value) in storage.chain(facts) {
            text += &format!("{name:<12} {value}\n");
        }
        text += &format!(
            "dims         {x} × {y} × {z}\ntype         {}\nspacing      {a} × {b} × {c}\nrange        {} to {}\n",
            self.voxel_type, self.range[0], self.range[1]
        );
        text += &match self.growth {
            None => "orientation unknown\n".to_string(),
            Some(ref growth) => format!("orientation  {orientation} ({growth})\n"),
        };
        let most = self.histogram.iter().map(|b| b.voxels).max().unwrap_or(0);
        // The empty background would dwarf everything else.
        text += "histogram    values, voxels, and bars on a logarithmic scale\n";
        for bin in &self.histogram {
            let length = 40.0 * (bin.voxels as f64 + 1.0).ln() / (most as f64 + 1.0).ln();
            let bar = "█".repeat(length.round() as usize);
            text += &format!(
                "{:>12.6} … {:<12.6} {:>12} {bar}\n",
                bin.low, bin.high, bin.voxels
            );
        }
        for note in &self.notes {
            text += &format!("note: {note}\n");
        }
        text
    }
}

/// Every device and its limits.
fn devices(json: bool) -> Result<String> {
    let devices = list_devices()?;
    if json {
        to_json(&devices)
    } else if devices.is_empty() {
        Ok("no Vulkan device was found".into())
    } else {
        Ok(devices.iter().map(device_table).collect())
    }
}

fn device_table(device: &DeviceSummary) -> String {
    let usable = if device.lacks.is_empty() {
        "yes".to_string()
    } else {
        format!("no, it lacks {}", device.lacks.join(", "))
    };
    let fallbacks = device.needs.iter().filter(|need| !need.holds);
    let fallbacks: String = fallbacks
        .filter_map(|need| {
            let fallback = need.fallback?;
            Some(format!("  without        {}: {fallback}\n", need.name))
        })
        .collect();
    format!(
        "{}: {}\n  kind           {}\n  driver         {}\n  Vulkan         {}\n  usable         {usable}\n  memory         {} device-local\n  3D images      {} texels a side at most\n  one buffer     {} at most\n  one allocation {} at most\n{fallbacks}",
        device.index,
        device.name,
        device.kind,
        device.driver,
        device.api,
        human(device.device_local_bytes),
        device.max_image_3d,
        human(device.max_storage_buffer_bytes),
        human(device.max_allocation_bytes),
    )
}
