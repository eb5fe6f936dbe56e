//! What `isolume view` takes.

use std::num::NonZeroU32;
use std::path::PathBuf;

use clap::Args;

use super::values::{extent, seed, spp, written};
use super::{GpuArgs, SceneArgs};

#[derive(Debug, Args)]
pub struct ViewArgs {
    #[command(flatten)]
    pub scene: SceneArgs,

    /// The window's size when it opens.
    #[arg(long, value_name = "WxH", default_value = "1280x800", value_parser = extent)]
    pub window: [u32; 2],

    /// Refine a picture at rest to so many samples per pixel.
    #[arg(long, value_name = "N", default_value = "1024", value_parser = spp)]
    pub spp: NonZeroU32,

    /// Seed of the random numbers.
    #[arg(long, value_name = "N", default_value = "0", value_parser = seed)]
    pub seed: u32,

    #[command(flatten)]
    pub gpu: GpuArgs,

    /// Write statistics of the session as JSON when the window closes.
    #[arg(long, value_name = "FILE.json", value_parser = written())]
    pub stats: Option<PathBuf>,

    /// Say nothing on stderr but errors.
    #[arg(long)]
    pub quiet: bool,
}
