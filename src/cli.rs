//! The command line: what the user typed, as typed values, and what is said in terms of it. It knows how a scene is named,
//! and nothing of how it is rendered.
//!
//! Scene keys that have a flag of their own become [`Edit`]s, the same as `--set`: there is one way
//! into a scene. Words such as `non-caching` are read by the scene's own types, so that a flag and
//! the file cannot drift apart.

mod bench;
mod cache;
mod message;
mod values;
#[cfg(feature = "window")]
mod view;

use std::num::NonZeroU32;
use std::path::PathBuf;
use std::time::Duration;

use clap::{ArgAction, Args, Parser, Subcommand};

use crate::engine::{HostOptions, Limit, SampleRange, Samples, Stop};
use crate::output::stem;
use crate::scene::preset::Preset;
use crate::scene::{Edit, Variant};
pub use bench::{BenchArgs, BenchVariant};
pub use cache::{CacheArgs, CleanArgs};
pub use message::{budget_source, message, why_stopped};
use values::{
    cache_format, cache_scale, device, exposure, exr, iso, limit, picture, positive, samples,
    seconds, seed, size, spp, variant, view, views, word, written,
};
#[cfg(feature = "window")]
pub use view::ViewArgs;

/// Renders scientific and medical volumes: global illumination and sharp isosurfaces, on Vulkan.
#[derive(Debug, Parser)]
#[command(name = "isolume", version, about, max_term_width = 100)]
pub struct Cli {
    #[command(subcommand)]
    pub command: Command,
}

#[derive(Debug, Subcommand)]
pub enum Command {
    /// Render a scene, or a bare volume with a preset.
    Render(Box<RenderArgs>),
    /// Open a window on a scene or a bare volume.
    #[cfg(feature = "window")]
    View(Box<ViewArgs>),
    /// Print what GPU memory a render would take, and allocate nothing.
    Plan(Box<PlanArgs>),
    /// Measure error against time for several variants, and write a report.
    Bench(Box<BenchArgs>),
    /// Print the complete scene as commented TOML.
    Scene(Box<SceneArgs>),
    /// Merge shards, which are pictures of one scene with different samples (`render --samples`).
    Merge(MergeArgs),
    /// Compare two pictures.
    Compare(CompareArgs),
    /// Check that each device has what Isolume needs, render scenes whose radiance is known, and measure the device's peak rates.
    Doctor(DoctorArgs),
    /// Describe the devices, or a volume.
    Info(InfoArgs),
    /// Remove the stores of volumes that earlier runs have made.
    Clean(CleanArgs),
}

/// What is rendered: shared by all commands that take a scene. A negative number is a wrong value of a flag, and not an unknown
/// flag.
#[derive(Debug, Args)]
#[command(allow_negative_numbers = true)]
pub struct SceneArgs {
    /// A scene file (.toml), or a volume: a file, or a folder of slices.
    #[arg(value_name = "SCENE_OR_VOLUME")]
    pub input: PathBuf,

    /// How to show a bare volume: ct (bone as a surface in soft tissue), generic (thresholds from the histogram), or auto: ct
    /// if its values are Hounsfield units.
    #[arg(long, default_value = "auto", value_parser = word::<Preset>)]
    pub preset: Preset,

    /// Look from a side: anterior posterior left right superior inferior +x -x +y -y +z -z.
    #[arg(long, allow_hyphen_values = true, value_parser = view)]
    pub view: Option<Edit>,

    /// Set the value of the only isosurface; if the scene has none, add one.
    #[arg(long, value_name = "VALUE", allow_hyphen_values = true, value_parser = iso)]
    pub iso: Option<Edit>,

    /// Pixels of the picture; by default the scene's or 1024x1024.
    #[arg(long, value_name = "WxH", value_parser = size)]
    pub size: Option<Edit>,

    /// How to render: auto (the default), caching, non-caching or published.
    #[arg(long, value_parser = variant)]
    pub variant: Option<Edit>,

    /// Cache nodes per voxel along an axis: auto, 1, 0.5, 0.25 or 0.125.
    #[arg(long, value_name = "SCALE", value_parser = cache_scale)]
    pub cache_scale: Option<Edit>,

    /// Cache precision: auto, f16 or f32.
    #[arg(long, value_name = "FORMAT", value_parser = cache_format)]
    pub cache_format: Option<Edit>,

    /// Set any key of the scene file, as in medium.g=0.5 or surfaces.iso.0.value=900 (repeatable).
    #[arg(long, value_name = "KEY=VALUE")]
    pub set: Vec<Edit>,

    #[command(flatten)]
    pub cache: CacheArgs,
}

impl SceneArgs {
    /// All changes to the scene. Those of flags with a name of their own come last, since they are more specific than
    /// `--set`.
    pub fn edits(&self) -> Vec<Edit> {
        let flags = [
            &self.view,
            &self.iso,
            &self.size,
            &self.variant,
            &self.cache_scale,
            &self.cache_format,
        ];
        let flags = flags.into_iter().flatten();
        self.set.iter().chain(flags).cloned().collect()
    }
}

#[derive(Debug, Args)]
pub struct RenderArgs {
    #[command(flatten)]
    pub scene: SceneArgs,

    /// Output: .exr or .png (repeatable; by default STEM.png and STEM.exr here).
    #[arg(short, long, value_name = "FILE", value_parser = picture())]
    output: Vec<PathBuf>,

    /// Stop after this many samples per pixel. If several limits are set, the one that is reached first ends the render.
    #[arg(long, value_name = "N", value_parser = spp)]
    pub spp: Option<NonZeroU32>,

    #[arg(long, value_name = "SECONDS", value_parser = seconds,
          help = format!("Stop after so many seconds of rendering; loading and compiling do not count; the first sample may take up to twice as long, or up to 5 s more if that is longer [if no limit is set: {}]", DEFAULT_TIME.as_secs()))]
    time: Option<Duration>,

    #[arg(long, value_name = "REL", value_parser = positive,
          help = format!("Stop at a relative error, rms(stderr)/mean [if no limit is set: {DEFAULT_ERROR}]"))]
    pub error: Option<f64>,

    /// Render only samples A to B-1 of every pixel: a shard, for `isolume merge`.
    #[arg(long, value_name = "A..B", value_parser = samples, conflicts_with_all = ["spp", "time", "error"])]
    pub samples: Option<SampleRange>,

    /// Render so many views around the object, from one cache: OUT.0001.exr and so on. --spp, --time and
    /// --error count for each view.
    #[arg(long, value_name = "N", value_parser = views)]
    pub orbit: Option<NonZeroU32>,

    /// Seed of the random numbers.
    #[arg(long, value_name = "N", default_value = "0", value_parser = seed)]
    pub seed: u32,

    #[command(flatten)]
    pub gpu: GpuArgs,

    /// Keep the render's state in this file; the same command goes on from it.
    #[arg(long, value_name = "FILE.exr", value_parser = exr())]
    pub checkpoint: Option<PathBuf>,

    /// Time between two checkpoints.
    #[arg(long, value_name = "SECONDS", default_value = "60", value_parser = seconds, requires = "checkpoint")]
    pub checkpoint_every: Duration,

    /// Start over, whatever the checkpoint holds.
    #[arg(long, requires = "checkpoint")]
    pub restart: bool,

    /// Write statistics as JSON, and print where the time went.
    #[arg(long, value_name = "FILE.json", value_parser = written())]
    pub stats: Option<PathBuf>,

    /// Write a Chrome/Perfetto trace: GPU passes, CPU stages, memory; and print where the time went.
    #[arg(long, value_name = "FILE.json", value_parser = written())]
    pub profile: Option<PathBuf>,

    /// Print errors only, without progress and notes.
    #[arg(long)]
    pub quiet: bool,
}

#[derive(Debug, Args)]
pub struct PlanArgs {
    #[command(flatten)]
    pub scene: SceneArgs,

    #[command(flatten)]
    pub gpu: GpuArgs,

    /// Print JSON.
    #[arg(long)]
    pub json: bool,
}

/// The device, and how much of it may be used.
#[derive(Debug, Args)]
pub struct GpuArgs {
    /// GPU memory to stay within: bytes, kB, KiB, MB, MiB, GB, GiB, or % of the device's memory, as in 2GiB. By default
    /// 95 % of what the driver says is left; where the device shares the host's memory, at most half of what is free.
    #[arg(long, value_name = "SIZE", value_parser = limit)]
    vram_budget: Option<Limit>,

    /// Host memory for voxels of a volume that does not fit the GPU: a size as above, or % of the free memory; by default half
    /// of it.
    #[arg(long, value_name = "SIZE", value_parser = limit)]
    ram_budget: Option<Limit>,

    /// The device's name, a part of it, or its index in `isolume info`.
    #[arg(long, value_name = "NAME|INDEX", value_parser = device)]
    device: Option<String>,
}

/// `ISOLUME_VALIDATION=1` watches the device with Vulkan's validation layers, and makes any of their messages an error.
pub fn wants_validation() -> bool {
    std::env::var_os("ISOLUME_VALIDATION").is_some_and(|v| v == "1")
}

impl GpuArgs {
    pub fn host_options(&self) -> HostOptions {
        HostOptions {
            device: self.device.clone(),
            vram_budget: self.vram_budget,
            ram_budget: self.ram_budget,
            validation: wants_validation(),
        }
    }
}

/// The time of a render for which no flag says when to stop.
const DEFAULT_TIME: Duration = Duration::from_secs(60);
const DEFAULT_ERROR: f64 = 0.02;

impl RenderArgs {
    /// `published` does not know its error: a render that was to stop by it alone takes the default time.
    pub fn stop(&self, variant: Variant) -> Stop {
        let given = Stop {
            samples: self
                .samples
                .map(Samples::Shard)
                .or(self.spp.map(Samples::Count)),
            time: self.time,
            relative_error: self.error.filter(|_| variant != Variant::Published),
        };
        let default = Stop {
            time: Some(DEFAULT_TIME),
            relative_error: Some(DEFAULT_ERROR).filter(|_| variant != Variant::Published),
            ..Stop::default()
        };
        if given == Stop::default() {
            default
        } else {
            given
        }
    }

    /// Whether the sums behind pictures are kept, so that they can be merged or continued later.
    pub fn keeps_sums(&self) -> bool {
        self.samples.is_some() || self.checkpoint.is_some()
    }

    /// The files to write.
    pub fn outputs(&self) -> Vec<PathBuf> {
        if !self.output.is_empty() {
            return self.output.clone();
        }
        let stem = stem(&self.scene.input);
        [".png", ".exr"]
            .map(|extension| PathBuf::from(stem.clone() + extension))
            .to_vec()
    }
}

#[derive(Debug, Args)]
pub struct MergeArgs {
    /// The file to write.
    #[arg(value_name = "OUT.exr", value_parser = exr())]
    pub output: PathBuf,

    /// Pictures of `render --samples`, checkpoints, or what has been merged before.
    #[arg(required = true, value_name = "A.exr")]
    pub shards: Vec<PathBuf>,

    /// No notes; errors only.
    #[arg(long)]
    pub quiet: bool,
}

#[derive(Debug, Args)]
pub struct CompareArgs {
    /// The reference.
    pub a: PathBuf,
    /// The picture that is compared with it.
    pub b: PathBuf,

    /// Two more pictures, of the same scenes as A and B, rendered with other seeds. With them, how much A and B differ apart
    /// from their noise is printed as well.
    #[arg(long, num_args = 2, value_names = ["A", "B"], action = ArgAction::Set)]
    pub again: Option<Vec<PathBuf>>,

    /// Print JSON.
    #[arg(long)]
    pub json: bool,

    /// Stops to add before the metrics that judge a display picture.
    #[arg(long, value_name = "STOPS", default_value = "0", allow_hyphen_values = true, value_parser = exposure)]
    pub exposure: f64,
}

#[derive(Debug, Args)]
pub struct DoctorArgs {
    /// Print JSON.
    #[arg(long)]
    pub json: bool,
}

#[derive(Debug, Args)]
pub struct InfoArgs {
    /// The volume or the folder of volumes to describe; without it, the devices.
    pub volume: Option<PathBuf>,

    /// Set a key of the volume, as in volume.channel=1 or volume.series=2 (repeatable).
    #[arg(long, value_name = "KEY=VALUE", requires = "volume")]
    pub set: Vec<Edit>,

    /// Print JSON.
    #[arg(long)]
    pub json: bool,
}
