//! Measures the most that a device can do of each kind of work that rendering consists of ([`Peak`]).
//!
//! Each rate is measured by a shader that does one kind of work alone (`glsl/peak_rate.comp`). The first dispatch is
//! tiny; it grows until it takes long enough to be timed, so that no device is kept busy for long. Dispatches are
//! short and many, and the fastest counts: on a CPU that other programs use as well, some of the dispatches have it
//! for themselves.

use std::sync::Arc;
use std::time::Instant;

use serde::Serialize;

use super::Peak;
use crate::error::Result;
use crate::gpu::types::*;
use crate::gpu::{
    Binding, Buffer, BufferDesc, Device, Format, Frame, Image, ImageDesc, Memory, Pass, PassDesc,
    Placement, Recording, Shaders, Shared,
};
use crate::shared;

shared! {
    pub struct PeakPush {
        /// How many times a thread repeats its work.
        pub steps: uint,
    }
}

/// The rates of a device in more detail.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct PeakRates {
    #[serde(flatten)]
    pub peak: Peak,
    /// Samples and reads per second of a volume that does not fit the caches.
    pub samples: f64,
    pub reads: f64,
    /// Seconds from the submission of a nearly empty dispatch to its end, as the host sees it.
    pub dispatch_s: f64,
    /// A long dispatch by the device's timestamps and by the host's clock, in seconds.
    pub longest_by_timestamps_s: f64,
    pub longest_by_host_s: f64,
    /// Bytes of the volume that does not fit the caches.
    pub volume_bytes: u64,
}

/// The least time of a dispatch that is timed, in seconds; the best of [`RUNS`] counts.
const LONG_ENOUGH_S: f64 = 0.002;
const RUNS: usize = 16;
const LATENCY_RUNS: usize = 50;
/// Length of the dispatch by which two clocks are compared, in seconds, and how many of them are tried.
const LONG_S: f64 = 0.02;
const CLOCK_RUNS: usize = 5;
/// The most copies in one submission.
const MOST_COPIES: u32 = 32;
/// Voxels a side of a volume that any cache holds.
const SMALL: u32 = 16;
/// Pixels a side of the picture that is written.
const PICTURE: u32 = 1024;
const STAGING_BYTES: u64 = 16 << 20;

/// The device's memory and queue on which the measurements run.
struct Bench {
    memory: Arc<Memory>,
    frame: Frame,
    threads: u32,
}

/// Measures the rates that passes are compared with, in one or two tenths of a second and in 34 MB, or fails if the budget is
/// smaller.
pub fn peak(device: &Arc<Device>, shaders: &Shaders, budget: u64) -> Result<Peak> {
    let mut bench = Bench::new(device, budget)?;
    let kernels = Kernels::new(device, shaders)?;
    let small = bench.volume([SMALL; 3])?;
    bench.peak(&kernels, &small)
}

/// Measures all rates, in a second or two and in an eighth of the budget at most.
pub fn peak_rates(device: &Arc<Device>, shaders: &Shaders) -> Result<PeakRates> {
    let (budget, _) = device.default_budget();
    let mut bench = Bench::new(device, budget)?;
    let kernels = Kernels::new(device, shaders)?;
    let small = bench.volume([SMALL; 3])?;
    let large = bench.volume(large_extent(budget, device.summary.kind.is_software()))?;
    let before = bench.peak(&kernels, &small)?;
    let samples = bench.reading(&kernels.samples, &large)?;
    let reads = bench.reading(&kernels.reads, &large)?;
    // What else runs on the machine may have slowed down either measurement.
    let peak = before.or_better(bench.peak(&kernels, &small)?);
    let [longest_by_timestamps_s, longest_by_host_s] = bench.clocks(&kernels, &small, &peak)?;
    Ok(PeakRates {
        peak,
        samples,
        reads,
        dispatch_s: bench.latency(&kernels.reads, &small)?,
        longest_by_timestamps_s,
        longest_by_host_s,
        volume_bytes: large.desc().bytes(),
    })
}

/// A pass for each kind of work.
struct Kernels {
    samples: Pass,
    reads: Pass,
    writes: Pass,
}

impl Kernels {
    fn new(device: &Arc<Device>, shaders: &Shaders) -> Result<Kernels> {
        let pass = |work| {
            let desc = PassDesc {
                name: "peak_rate",
                specialization: &[],
                push: PeakPush::PUSH,
                macros: &[(work, "1".into())],
            };
            Pass::new(device, shaders, &desc)
        };
        Ok(Kernels {
            samples: pass("SAMPLES")?,
            reads: pass("READS")?,
            writes: pass("WRITES")?,
        })
    }
}

/// Extent of a volume larger than the caches: 256 MiB on a GPU and 64 MiB on a CPU, or a sixteenth of the memory.
fn large_extent(budget: u64, is_software: bool) -> [u32; 3] {
    let mut extent = if is_software {
        [256, 512, 512]
    } else {
        [512, 512, 1024]
    };
    while extent.iter().map(|&n| u64::from(n)).product::<u64>() > budget / 16 && extent[2] > 1 {
        extent[2] /= 2;
    }
    extent
}

impl Bench {
    fn new(device: &Arc<Device>, budget: u64) -> Result<Bench> {
        let is_software = device.summary.kind.is_software();
        Ok(Bench {
            memory: Memory::new(device, budget)?,
            frame: Frame::new(device)?,
            threads: if is_software { 1 << 13 } else { 1 << 20 },
        })
    }

    /// Measures the rates that passes are compared with; `small` fits the caches.
    fn peak(&mut self, kernels: &Kernels, small: &Image) -> Result<Peak> {
        Ok(Peak {
            samples_cached: self.reading(&kernels.samples, small)?,
            reads_cached: self.reading(&kernels.reads, small)?,
            writes: self.writing(&kernels.writes)?,
            copied_bytes: self.copying()?,
        })
    }

    fn buffer(&self, name: &'static str, bytes: u64, placement: Placement) -> Result<Buffer> {
        let desc = BufferDesc {
            name,
            bytes,
            placement,
        };
        Buffer::new(&self.memory, desc)
    }

    /// A volume of noise, which no device can compress.
    fn volume(&mut self, extent: [u32; 3]) -> Result<Image> {
        let desc = ImageDesc::volumetric("voxels", extent, Format::R8_UNORM);
        let image = Image::new(&self.memory, desc)?;
        let [width, height, depth] = extent;
        let slice = u64::from(width) * u64::from(height);
        let slices = (STAGING_BYTES / slice).clamp(1, u64::from(depth)) as u32;
        let staging = self.buffer("staging", slice * u64::from(slices), Placement::Upload)?;
        let noise =
            (0..staging.desc().bytes as u32).map(|i| (i.wrapping_mul(2_654_435_761) >> 24) as u8);
        staging.write(&noise.collect::<Vec<u8>>());
        for z in (0..depth).step_by(slices as usize) {
            let extent = [width, height, slices.min(depth - z)];
            self.frame
                .run(|recording| recording.upload(&staging, &image, [0, 0, z], extent))?;
        }
        Ok(image)
    }

    /// Measures samples or reads per second.
    fn reading(&mut self, pass: &Pass, volume: &Image) -> Result<f64> {
        let sums = self.sums()?;
        let bindings = [
            ("volume", Binding::Image(volume)),
            ("sums", Binding::Buffer(&sums)),
        ];
        self.working(pass, &bindings)
    }

    fn sums(&self) -> Result<Buffer> {
        self.buffer("sums", 4 * u64::from(self.threads), Placement::Device)
    }

    /// Measures written texels per second.
    fn writing(&mut self, pass: &Pass) -> Result<f64> {
        let desc = ImageDesc::flat("picture", [PICTURE, PICTURE], Format::R32G32B32A32_SFLOAT)
            .written()
            .zeroed();
        let picture = Image::new(&self.memory, desc)?;
        self.working(pass, &[("picture", Binding::Image(&picture))])
    }

    /// Measures the steps of all threads per second.
    fn working<'r>(&mut self, pass: &'r Pass, bindings: &[(&str, Binding<'r>)]) -> Result<f64> {
        let threads = self.threads;
        let seconds = self.fastest(u32::MAX, |recording, steps| {
            recording.dispatch(pass, bindings, &PeakPush { steps }, [threads, 1, 1])
        })?;
        Ok(f64::from(threads) / seconds)
    }

    /// Measures copied bytes per second.
    fn copying(&mut self) -> Result<f64> {
        let from = self.buffer("copied from", STAGING_BYTES, Placement::Device)?;
        let to = self.buffer("copied to", STAGING_BYTES, Placement::Device)?;
        self.frame.run(|recording| recording.zero(&from))?;
        let seconds = self.fastest(MOST_COPIES, |recording, copies| {
            (0..copies).try_for_each(|_| recording.copy(&from, &to))
        })?;
        Ok(STAGING_BYTES as f64 / seconds)
    }

    /// Seconds of a dispatch that is much longer than its submission, by the device's timestamps and by the host's
    /// clock: of a few dispatches, the one for which the host was the least late.
    fn clocks(&mut self, kernels: &Kernels, volume: &Image, peak: &Peak) -> Result<[f64; 2]> {
        let sums = self.sums()?;
        let bindings = [
            ("volume", Binding::Image(volume)),
            ("sums", Binding::Buffer(&sums)),
        ];
        let threads = self.threads;
        let steps = (peak.reads_cached / f64::from(threads) * LONG_S).ceil() as u32;
        let push = PeakPush { steps };
        let mut best = [0.0, f64::INFINITY];
        for _ in 0..CLOCK_RUNS {
            let times = self.time(|recording| {
                recording.dispatch(&kernels.reads, &bindings, &push, [threads, 1, 1])
            })?;
            if times[1] - times[0] < best[1] - best[0] {
                best = times;
            }
        }
        Ok(best)
    }

    /// Seconds that the host waits for a workgroup that takes one step.
    fn latency(&mut self, pass: &Pass, volume: &Image) -> Result<f64> {
        let sums = self.sums()?;
        let bindings = [
            ("volume", Binding::Image(volume)),
            ("sums", Binding::Buffer(&sums)),
        ];
        let mut waits = Vec::with_capacity(LATENCY_RUNS);
        for _ in 0..LATENCY_RUNS {
            let push = PeakPush { steps: 1 };
            let [_, host_s] =
                self.time(|recording| recording.dispatch(pass, &bindings, &push, [64, 1, 1]))?;
            waits.push(host_s);
        }
        waits.sort_by(f64::total_cmp);
        Ok(waits[LATENCY_RUNS / 2])
    }

    /// The least time of a step of `record`, in seconds. Its dispatches have as many steps as take long enough to be
    /// timed, or `most`.
    fn fastest<'r>(
        &mut self,
        most: u32,
        record: impl Fn(&mut Recording<'_, 'r>, u32) -> Result<()>,
    ) -> Result<f64> {
        // Some drivers finish compiling only when a pass first runs.
        self.time(|recording| record(recording, 1))?;
        let mut steps = 1;
        loop {
            let [s, _] = self.time(|recording| record(recording, steps))?;
            let growth = (LONG_ENOUGH_S / s).clamp(1.0, 16.0);
            if growth < 1.5 || steps == most {
                break;
            }
            // Rounded up, so that a single step grows as well.
            steps = (f64::from(steps) * growth).ceil().min(f64::from(most)) as u32;
        }
        let mut best = f64::INFINITY;
        for _ in 0..RUNS {
            let [device_s, _] = self.time(|recording| record(recording, steps))?;
            best = best.min(device_s / f64::from(steps));
        }
        Ok(best)
    }

    /// The time of the recorded work in seconds, by the device's timestamps and by the host's clock.
    fn time<'r>(
        &mut self,
        record: impl FnOnce(&mut Recording<'_, 'r>) -> Result<()>,
    ) -> Result<[f64; 2]> {
        self.frame.timings.take();
        let began = Instant::now();
        self.frame.run(record)?;
        let host_s = began.elapsed().as_secs_f64();
        let spans = self.frame.timings.spans().iter();
        let device_us: f64 = spans.map(|span| span.duration_us).sum();
        Ok([device_us.max(1e-3) * 1e-6, host_s])
    }
}
