//! `isolume doctor`: whether a device does what Isolume asks of it, and how fast it can be at best. A page that its
//! owner can send to whoever has to find out why a picture is wrong or slow.
//!
//! Limits and formats are what the driver says. The rest is tried: the texture filter, the timestamps, and small scenes
//! whose radiance is known exactly, rendered by the same [`crate::Engine`] that renders everything else.

mod closed_forms;
mod page;

use std::ops::RangeInclusive;
use std::sync::Arc;
use std::time::{Duration, Instant};

use serde::Serialize;

use crate::engine::Host;
use crate::error::Result;
use crate::gpu::{Device, DeviceChoice, DeviceSummary, Format, Shaders, Validation};
use crate::render::{PeakRates, filter_error, peak_rates, shared};
use closed_forms::ClosedForm;
#[doc(hidden)]
pub use closed_forms::{LIT_SURFACE, lit_surface_scene};

/// Time limit for the examination of one device: a closed-form check that is expected to end later is not begun.
const TIME: Duration = Duration::from_secs(20);
/// The device's time of a dispatch as a share of the host's, which holds submission and waiting as well, where timestamps can be
/// trusted.
const DEVICE_SHARE: RangeInclusive<f64> = 0.2..=1.02;

/// What was found out about one device.
#[derive(Debug, Serialize)]
pub struct Examination {
    #[serde(flatten)]
    pub device: DeviceSummary,
    /// How far the device's filters are off; they read no volume.
    pub filters: Vec<Filter>,
    pub closed_forms: Vec<ClosedForm>,
    /// Checks for which the device was too slow.
    pub left_out: Vec<&'static str>,
    /// `None` where the queue writes none.
    pub timestamps: Option<Timestamps>,
    pub rates: Option<PeakRates>,
    /// Why the examination ended early.
    pub fault: Option<String>,
    pub seconds: f64,
    /// Whether nothing is wrong.
    pub holds: bool,
}

/// The device's filter for volumes of one format.
#[derive(Debug, Serialize)]
pub struct Filter {
    pub format: &'static str,
    /// Largest error between two voxels, as a share of their difference; `None`: the device has no such filter.
    pub error: Option<f32>,
}

/// How long one dispatch took by either clock, in seconds.
#[derive(Debug, Serialize)]
pub struct Timestamps {
    pub by_device_s: f64,
    pub by_host_s: f64,
    /// Whether the device's time is as large a share of the host's as can be expected.
    pub holds: bool,
}

/// Examines every device that a driver shows. `validation`: Vulkan's validation layers watch, and what they say is a
/// fault.
pub fn examine_all(devices: Vec<DeviceSummary>, validation: bool) -> Vec<Examination> {
    let examine = |device| Examination::of(device, validation);
    devices.into_iter().map(examine).collect()
}

/// The page, one part a device.
pub fn page(examinations: &[Examination]) -> String {
    page::page(examinations)
}

impl Examination {
    fn of(device: DeviceSummary, validation: bool) -> Examination {
        let began = Instant::now();
        let mut examination = Examination {
            filters: Vec::new(),
            closed_forms: Vec::new(),
            left_out: Vec::new(),
            timestamps: None,
            rates: None,
            fault: None,
            seconds: 0.0,
            holds: false,
            device,
        };
        if examination.device.lacks.is_empty() {
            let fault = examination.fill(validation, began + TIME).err();
            examination.fault = fault.map(|error| error.to_string());
        }
        examination.seconds = began.elapsed().as_secs_f64();
        examination.holds = examination.device.lacks.is_empty()
            && examination.fault.is_none()
            && examination.closed_forms.iter().all(|form| form.holds)
            && examination.timestamps.as_ref().is_none_or(|t| t.holds);
        examination
    }

    fn fill(&mut self, validation: bool, until: Instant) -> Result<()> {
        let choice = DeviceChoice {
            wanted: Some(self.device.index.to_string()),
            validation: Validation::when(validation),
            ..DeviceChoice::default()
        };
        let device = Device::open(&choice)?;
        let shaders = Shaders::new(shared::glsl());
        self.filters = filters(&device, &shaders)?;
        let rates = peak_rates(&device, &shaders)?;
        self.timestamps = device.writes_timestamps.then(|| Timestamps::of(&rates));
        self.rates = Some(rates);
        let host = Host::with_device(device, None, None);
        closed_forms::check_all(&host, until, &mut self.closed_forms, &mut self.left_out)?;
        host.check_validation()
    }
}

fn filters(device: &Arc<Device>, shaders: &Shaders) -> Result<Vec<Filter>> {
    let formats = [
        ("R8_UNORM", Format::R8_UNORM),
        ("R16_UNORM", Format::R16_UNORM),
        ("R32_SFLOAT", Format::R32_SFLOAT),
    ];
    let filter = |(name, format)| {
        Ok(Filter {
            format: name,
            error: filter_error(device, shaders, format)?,
        })
    };
    formats.into_iter().map(filter).collect()
}

impl Timestamps {
    fn of(rates: &PeakRates) -> Timestamps {
        let [by_device_s, by_host_s] = [rates.longest_by_timestamps_s, rates.longest_by_host_s];
        Timestamps {
            by_device_s,
            by_host_s,
            holds: DEVICE_SHARE.contains(&(by_device_s / by_host_s)),
        }
    }
}
