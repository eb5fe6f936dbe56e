//! `isolume info`: what a device can do, or what is in a volume.

use std::path::Path;

use serde::Serialize;

use crate::error::{Error, Result};
use crate::gpu::{DeviceSummary, list_devices};
use crate::scene::volume::{Storage, Volume, VolumeOverrides};

/// Bars of the histogram.
const BINS: usize = 16;

#[derive(Serialize)]
struct VolumeInfo {
    #[serde(flatten)]
    storage: Storage,
    dims: [u32; 3],
    #[serde(rename = "type")]
    voxel_type: String,
    spacing: [f64; 3],
    range: [f64; 2],
    /// Where i, j and k grow; `None`: unknown.
    orientation: Option<String>,
    histogram: Vec<Bin>,
    notes: Vec<String>,
}

#[derive(Serialize)]
struct Bin {
    low: f64,
    high: f64,
    voxels: u64,
}

/// One block of text, or JSON.
pub fn volume(path: &Path, json: bool) -> Result<String> {
    let volume = Volume::load(path, &VolumeOverrides::default())?;
    let histogram = volume.histogram(BINS)?;
    let bins = histogram.counts.iter().enumerate().map(|(i, &voxels)| Bin {
        low: histogram.low + i as f64 * histogram.width,
        high: histogram.low + (i + 1) as f64 * histogram.width,
        voxels,
    });
    let info = VolumeInfo {
        storage: volume.storage,
        dims: volume.dims,
        voxel_type: volume.voxel_type.to_string(),
        spacing: volume.spacing,
        range: volume.range,
        orientation: volume.axes.map(|axes| axes.to_string()),
        histogram: bins.collect(),
        notes: volume.notes,
    };
    match json {
        true => to_json(&info),
        false => Ok(info.table()),
    }
}

impl VolumeInfo {
    fn table(&self) -> String {
        let [x, y, z] = self.dims;
        let [a, b, c] = self.spacing;
        let orientation = self.orientation.as_deref().unwrap_or("unknown");
        let lines = self.storage.lines().into_iter();
        let mut text: String = lines
            .map(|(key, value)| format!("{key:<12} {value}\n"))
            .collect();
        text += &format!(
            "dims         {x} × {y} × {z}\ntype         {}\nspacing      {a} × {b} × {c}\nrange        {} to {}\n",
            self.voxel_type, self.range[0], self.range[1]
        );
        text += &match orientation {
            "unknown" => "orientation unknown\n".to_string(),
            letters => format!("orientation  {letters} (where x, y, z grow)\n"),
        };
        let most = self.histogram.iter().map(|b| b.voxels).max().unwrap_or(0);
        for bin in &self.histogram {
            // Logarithmic: the empty background would dwarf everything else.
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
pub fn devices(json: bool) -> Result<String> {
    let devices = list_devices()?;
    match json {
        true => to_json(&devices),
        false if devices.is_empty() => Ok("no Vulkan device was found".into()),
        false => Ok(devices.iter().map(device_table).collect()),
    }
}

fn device_table(device: &DeviceSummary) -> String {
    let usable = match device.lacks.is_empty() {
        true => "yes".to_string(),
        false => format!("no, it lacks {}", device.lacks.join(", ")),
    };
    let gib = |bytes: u64| bytes as f64 / (1u64 << 30) as f64;
    format!(
        "{}: {}\n  kind           {}\n  driver         {}\n  Vulkan         {}\n  usable         {usable}\n  memory         {:.2} GiB device-local\n  3D images      {} texels a side at most\n  one buffer     {:.2} GiB at most\n  one allocation {:.2} GiB at most\n",
        device.index,
        device.name,
        device.kind,
        device.driver,
        device.api,
        gib(device.device_local_bytes),
        device.max_image_3d,
        gib(device.max_storage_buffer_bytes),
        gib(device.max_allocation_bytes),
    )
}

pub fn to_json(value: &impl Serialize) -> Result<String> {
    serde_json::to_string_pretty(value).map_err(|e| Error::Input(format!("JSON: {e}")))
}
