//! The results of a bench, as report.json holds them. Field names are a contract with scripts; numbers that are
//! unknown or infinite are null.

use serde::Serialize;

use crate::cli::BenchArgs;
use crate::compare::{Comparison, WithoutNoise};
use crate::engine::Host;
use crate::engine::figures::{CacheStats, MemoryStats, PassStats};
use crate::scene::Opened;
use crate::scene::file::ShadingModel;

#[derive(Debug, Serialize)]
pub struct Report {
    pub version: &'static str,
    pub command: String,
    pub device: String,
    pub driver: String,
    pub budget_bytes: u64,
    pub scene: String,
    pub volume_dims: [u32; 3],
    /// Width and height of the pictures.
    pub size: [u32; 2],
    pub seed: u32,
    /// The times at which pictures are taken.
    pub seconds: Vec<f64>,
    /// One for each shading model; a single one, as the scene has it, where none was named.
    pub subjects: Vec<SubjectReport>,
}

#[derive(Debug, Serialize)]
pub struct SubjectReport {
    /// The shading model; null where it is as the scene has it.
    pub shading: Option<ShadingModel>,
    /// Prefix of the names of its files.
    #[serde(skip)]
    pub prefix: String,
    pub reference: ReferenceReport,
    /// The reference whose rays go through the middle of each pixel; null without a cache.
    pub reference_of_centres: Option<ReferenceReport>,
    pub runs: Vec<RunReport>,
    /// How similar each run is to the non-caching one at the same times.
    pub similarity: Vec<Similarity>,
    /// Pictures through coarser and shorter caches against those through the finest one, in 32 bits.
    pub cache_settings: Vec<CacheSetting>,
    /// What was not measured, and why.
    pub skipped: Vec<String>,
}

#[derive(Debug, Serialize)]
pub struct ReferenceReport {
    pub file: String,
    /// How long it was rendered; null where it was given as a file.
    pub seconds: Option<f64>,
    pub samples: Option<u32>,
    /// The metrics of a picture that differs from the reference by as much noise as its standard error states; null
    /// if it states none.
    pub noise: Option<Comparison>,
}

#[derive(Debug, Serialize)]
pub struct RunReport {
    /// The variant as it is written on the command line.
    pub variant: String,
    /// The plan that was made for the variant, and the reason.
    pub plan: String,
    pub reason: String,
    /// The time until the first path could start, without the reading of the volume.
    pub load_s: f64,
    pub points: Vec<Point>,
    pub seconds_to_30_db: Option<f64>,
    pub seconds_to_40_db: Option<f64>,
    pub paths_per_second: f64,
    pub lookups_per_path: f64,
    /// The GPU's passes up to the last of the points.
    pub passes: Vec<PassStats>,
    pub memory: MemoryStats,
    /// Null without a cache.
    pub cache: Option<CacheStats>,
    pub bytes_per_active_cell: Option<f64>,
    pub bytes_per_voxel: Option<f64>,
    pub orbit: Option<Orbit>,
    /// The same view, with the cache that the run left once it has been made as good for all views (in a time that is
    /// not counted): a march, and what more of its rays and samples make of it.
    pub new_view: Vec<Point>,
    /// The first picture of that view, against a reference of the same rays: one through the middle of each pixel.
    pub same_rays: Option<Comparison>,
    /// The bias of that picture against the same reference.
    pub bias_apart: Option<BiasApart>,
    /// Null without a medium, and in `published`.
    pub edit: Option<Edit>,
    /// Null without a cache or a surface, and in `full` light, whose cache an isovalue clears.
    pub isovalue: Option<IsovalueEdit>,
}

/// The bias of a picture relative to the light of the reference, in pixels in whose middle a surface is seen, and in those
/// with medium alone that covers at least a hundredth; null where there are none.
#[derive(Debug, Serialize)]
pub struct BiasApart {
    pub surfaces: Option<f64>,
    pub medium: Option<f64>,
}

/// A picture at some time, against the reference.
#[derive(Debug, Clone, Serialize)]
pub struct Point {
    pub asked_s: f64,
    /// The time of the picture, which may be late: a picture can only be taken between two units of work.
    pub seconds: f64,
    /// CPU time of all cores, in seconds: it is the measure where the device is a busy CPU.
    pub cpu_s: f64,
    pub file: Option<String>,
    pub samples: u32,
    /// Paths that the nodes in sight have had.
    pub paths_per_cell: Option<u32>,
    #[serde(flatten)]
    pub error: Comparison,
    /// Efficiency, 1/(MSE·s).
    pub efficiency: f64,
    /// Whether the MSE is at most twice that of the reference's noise: it says little about the picture then.
    pub within_reference_noise: bool,
}

impl Point {
    /// Whether the picture came noticeably later than asked for.
    pub fn is_late(&self) -> bool {
        self.seconds > 1.1 * self.asked_s
    }
}

/// Pictures marched through the cache from all sides.
#[derive(Debug, Serialize)]
pub struct Orbit {
    pub frames: usize,
    /// Milliseconds that the ray-march takes on the device.
    pub march_ms_median: f64,
    pub march_ms_p99: f64,
    /// Milliseconds from the camera's change to the end of the march.
    pub frame_ms_median: f64,
    pub frame_ms_p99: f64,
    /// CPU time of all cores for one frame, in milliseconds.
    pub frame_cpu_ms_median: f64,
}

/// The time from an edit of the transfer function until the first pass can show it.
#[derive(Debug, Serialize)]
pub struct Edit {
    pub ms_min: f64,
    pub ms_median: f64,
    /// The CPU time of all cores.
    pub cpu_ms_median: f64,
}

/// An isovalue is dragged to the scene's own while the cache is warm.
#[derive(Debug, Serialize)]
pub struct IsovalueEdit {
    /// Pictures of the first frame that shows it, and of later ones.
    pub points: Vec<Point>,
    pub seconds_to_40_db: Option<f64>,
}

#[derive(Debug, Serialize)]
pub struct Similarity {
    pub variant: String,
    pub points: Vec<SimilarityPoint>,
}

#[derive(Debug, Serialize)]
pub struct SimilarityPoint {
    pub asked_s: f64,
    pub psnr: f64,
    pub ssim: Option<f64>,
}

#[derive(Debug, Serialize)]
pub struct CacheSetting {
    pub variant: String,
    /// Paths that the nodes in sight have had.
    pub paths_per_cell: u32,
    /// The cache's own estimate of its error: it limits how far the other figures can be trusted.
    pub relative_error: f64,
    /// Null for the finest cache itself.
    pub psnr: Option<f64>,
    pub ssim: Option<f64>,
    /// `None` where the paths are the same, so that there is no noise to leave out.
    #[serde(flatten)]
    pub without_noise: Option<WithoutNoise>,
    pub bytes: u64,
    pub active_cells: u64,
    pub bytes_per_active_cell: f64,
    pub bytes_per_voxel: f64,
}

impl Report {
    pub fn new(
        args: &BenchArgs,
        seed: u32,
        host: &Host,
        opened: &Opened,
        subjects: Vec<SubjectReport>,
    ) -> Report {
        // Paths may hold bytes that are no text.
        let words: Vec<String> = std::env::args_os()
            .skip(1)
            .map(|word| quoted(&word.to_string_lossy()))
            .collect();
        Report {
            version: env!("CARGO_PKG_VERSION"),
            command: format!("isolume {}", words.join(" ")),
            device: host.summary().name.clone(),
            driver: host.summary().driver.clone(),
            budget_bytes: host.budget().bytes,
            scene: args.scene.input.display().to_string(),
            volume_dims: opened.volume.dims,
            size: opened.scene.render.size,
            seed,
            seconds: args.seconds().iter().map(|s| s.as_secs_f64()).collect(),
            subjects,
        }
    }
}

/// The time at which a run reaches `psnr` dB. PSNR is taken as linear in the time's logarithm between two points, as
/// it is where the error falls as a power of the time. It is the first point's time if that one has reached it.
pub fn seconds_to(psnr: f64, points: &[Point]) -> Option<f64> {
    let after = points.iter().position(|p| p.error.psnr >= psnr)?;
    let later = &points[after];
    let Some(earlier) = after.checked_sub(1).map(|i| &points[i]) else {
        return Some(later.seconds);
    };
    if later.error.psnr.is_infinite() {
        return Some(later.seconds);
    }
    let share = (psnr - earlier.error.psnr) / (later.error.psnr - earlier.error.psnr);
    let ratio = later.seconds / earlier.seconds;
    Some(earlier.seconds * ratio.powf(share))
}

/// A word of a command, as a shell takes it.
fn quoted(word: &str) -> String {
    let is_plain = |c: char| c.is_alphanumeric() || "_-./:=,+%@".contains(c);
    if !word.is_empty() && word.chars().all(is_plain) {
        word.to_string()
    } else {
        format!("'{}'", word.replace('\'', r"'\''"))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_command_can_be_pasted_into_a_shell() {
        let words = ["caching:0.5:f16", "a b.toml", "it's", ""].map(quoted);
        assert_eq!(words, ["caching:0.5:f16", "'a b.toml'", r"'it'\''s'", "''"]);
    }
}
