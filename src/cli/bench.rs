//! What `isolume bench` takes.

use std::fmt;
use std::path::PathBuf;
use std::str::FromStr;
use std::time::Duration;

use clap::Args;

use super::values::{seconds, seed, word};
use super::{GpuArgs, SceneArgs};
use crate::scene::file::ShadingModel;
use crate::scene::{CacheFormat, CacheScale, Variant};

#[derive(Debug, Args)]
pub struct BenchArgs {
    #[command(flatten)]
    pub scene: SceneArgs,

    /// The folder for report.md, report.json, plots and pictures; made if it is missing.
    #[arg(short = 'o', long = "output", value_name = "DIR")]
    pub folder: PathBuf,

    /// What to measure: auto, non-caching, published, or caching[:SCALE[:FORMAT]] as in caching:0.5:f16.
    /// Without it: non-caching, the caches at 1, 0.5 and 0.25 in f16 that fit, and published.
    #[arg(long, value_name = "V,…", value_delimiter = ',')]
    variants: Vec<BenchVariant>,

    /// When to look at the picture, in seconds of rendering; the filling of a cache counts.
    #[arg(long, value_name = "S,…", value_delimiter = ',', default_value = "1,2,4,8,16",
          value_parser = seconds)]
    seconds: Vec<Duration>,

    /// A converged picture; without it, non-caching renders one for four times the longest time. If a cache is measured, a
    /// second one is always rendered for as long, with rays through the middle of each pixel, as those of a march.
    #[arg(long, value_name = "FILE")]
    pub reference: Option<PathBuf>,

    /// Repeat all measurements with every surface shaded like this: lambert, phong, disney.
    #[arg(long, value_name = "MODEL,…", value_delimiter = ',', value_parser = word::<ShadingModel>)]
    shading: Vec<ShadingModel>,

    /// Seed of the random numbers; a reference that is rendered here has another one. Without it: 0, or 1 if that is the
    /// seed of --reference.
    #[arg(long, value_name = "N", value_parser = seed)]
    pub seed: Option<u32>,

    #[command(flatten)]
    pub gpu: GpuArgs,

    /// Say nothing on stderr but errors.
    #[arg(long)]
    pub quiet: bool,
}

impl BenchArgs {
    /// The times to look at the picture, in ascending order, each once.
    pub fn seconds(&self) -> Vec<Duration> {
        let mut seconds = self.seconds.clone();
        seconds.sort();
        seconds.dedup();
        seconds
    }

    /// What to measure, each variant once; empty if that is left open.
    pub fn variants(&self) -> Vec<BenchVariant> {
        each_once(&self.variants)
    }

    /// The shading models to measure with, each once; empty if surfaces stay as they are.
    pub fn shading(&self) -> Vec<ShadingModel> {
        each_once(&self.shading)
    }
}

fn each_once<T: Copy + PartialEq>(values: &[T]) -> Vec<T> {
    let mut found = Vec::new();
    for value in values {
        if !found.contains(value) {
            found.push(*value);
        }
    }
    found
}

/// A variant and how its cache is made, as in `caching:0.5:f16`.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct BenchVariant {
    pub variant: Variant,
    pub scale: CacheScale,
    pub format: CacheFormat,
}

impl BenchVariant {
    pub const fn without_cache(variant: Variant) -> BenchVariant {
        BenchVariant {
            variant,
            scale: CacheScale::Auto,
            format: CacheFormat::Auto,
        }
    }

    pub const fn caching(scale: f64, format: CacheFormat) -> BenchVariant {
        BenchVariant {
            variant: Variant::Caching,
            scale: CacheScale::Fixed(scale),
            format,
        }
    }
}

impl FromStr for BenchVariant {
    type Err = String;

    fn from_str(text: &str) -> Result<BenchVariant, String> {
        let mut words = text.split(':');
        let variant = word::<Variant>(words.next().unwrap_or_default())?;
        let (scale, format) = (words.next(), words.next());
        if words.next().is_some() || (variant != Variant::Caching && scale.is_some()) {
            return Err("expected auto, non-caching, published or caching[:SCALE[:FORMAT]]".into());
        }
        Ok(BenchVariant {
            variant,
            scale: scale.map_or(Ok(CacheScale::Auto), word)?,
            format: format.map_or(Ok(CacheFormat::Auto), word)?,
        })
    }
}

/// The variant as it is written on the command line, without what is left to the plan.
impl fmt::Display for BenchVariant {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(self.variant.name())?;
        let scale = match self.scale {
            CacheScale::Fixed(scale) => scale.to_string(),
            CacheScale::Auto => "auto".into(),
        };
        match (self.scale, self.format) {
            (CacheScale::Auto, CacheFormat::Auto) => Ok(()),
            (_, CacheFormat::Auto) => write!(f, ":{scale}"),
            (_, format) => write!(f, ":{scale}:{}", format.name()),
        }
    }
}
