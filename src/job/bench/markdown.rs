//! report.md: the contents of report.json for people.

use super::plots::{ERROR_TIME, PSNR_TIME, SIMILARITY_TIME};
use super::report::{BiasApart, CacheSetting, Point, Report, RunReport, SubjectReport};
use super::table::{Table, by_time, decibels, number};
use crate::bytes::human;
use crate::compare::{Comparison, WithoutNoise};

/// Bytes of the paper's 14 floats.
const PAPER_BYTES_PER_VOXEL: f64 = 56.0;

/// The page of a report. `plotted` are the plots that there are.
pub fn page(report: &Report, plotted: &[String]) -> String {
    let [width, height] = report.size;
    let [x, y, z] = report.volume_dims;
    let mut page = format!(
        "# Error against time: {}\n\n`{}`\n\n\
         Isolume {}, {} ({}), seed {}; a volume of {x}×{y}×{z} voxels, pictures of {width}×{height} \
         pixels. Times are seconds of rendering: the filling of a cache counts, the compiling of \
         shaders and the writing of pictures do not.\n",
        report.scene, report.command, report.version, report.device, report.driver, report.seed,
    );
    for subject in &report.subjects {
        if let Some(model) = subject.shading {
            page += &format!("\n# Shading: {}\n", model.name());
        }
        page += &sections(report, subject, plotted);
    }
    page + READING
}

fn sections(report: &Report, subject: &SubjectReport, plotted: &[String]) -> String {
    let plot = |name: &str, what: &str| {
        let file = format!("{}{name}", subject.prefix);
        if plotted.contains(&file) {
            format!("\n![{what}]({file})\n")
        } else {
            String::new()
        }
    };
    [
        reference(subject),
        format!("\n## Error\n{}", plot(ERROR_TIME, "MSE against time")),
        final_errors(subject),
        format!("\n{}", plot(PSNR_TIME, "PSNR against time")),
        over_time(report, subject),
        new_views(subject),
        frames(subject),
        memory(subject),
        passes(subject),
        if subject.similarity.is_empty() {
            String::new()
        } else {
            similarity(report, subject) + &plot(SIMILARITY_TIME, "Similarity over time")
        },
        cache_settings(&subject.cache_settings),
        skipped(subject),
    ]
    .concat()
}

fn reference(subject: &SubjectReport) -> String {
    let reference = &subject.reference;
    let made = match (reference.seconds, reference.samples) {
        (Some(seconds), Some(samples)) => format!(
            ", rendered here without a cache and with another seed: {samples} samples per pixel in \
             {seconds:.1} s"
        ),
        _ => ", as given".into(),
    };
    let noise = match &reference.noise {
        Some(noise) => format!(
            "By its own estimate, its noise is an MSE of {}, or {} dB: values near that, marked \
             with \\*, may be better than they look.",
            number(noise.mse),
            decibels(noise.psnr)
        ),
        None => "It does not say how noisy it is.".into(),
    };
    format!("\nThe reference is `{}`{made}. {noise}\n", reference.file)
}

fn final_errors(subject: &SubjectReport) -> String {
    let mut table = Table::new(&[
        "variant",
        "seconds",
        "samples",
        "MSE",
        "relMSE",
        "PSNR",
        "SSIM",
        "FLIP",
        "bias of the mean",
        "1/(MSE·s)",
        "to 30 dB",
        "to 40 dB",
    ]);
    for run in &subject.runs {
        let Some(last) = run.points.last() else {
            continue;
        };
        let reached = |seconds: Option<f64>| match seconds {
            Some(seconds) if seconds == run.points[0].seconds => format!("≤ {} s", number(seconds)),
            Some(seconds) => format!("{} s", number(seconds)),
            None => format!("not within {} s", number(last.seconds)),
        };
        table.row(
            [
                run.variant.clone(),
                format!("{:.2}", last.seconds),
                last.samples.to_string(),
            ]
            .into_iter()
            .chain(errors(&last.error, last.within_reference_noise))
            .chain([
                bias(&last.error),
                number(last.efficiency),
                reached(run.seconds_to_30_db),
                reached(run.seconds_to_40_db),
            ]),
        );
    }
    if let Some(noise) = &subject.reference.noise {
        let name = ["the reference's own noise", "", ""].map(String::from);
        let rest = ["", "", "", ""].map(String::from);
        table.row(name.into_iter().chain(errors(noise, false)).chain(rest));
    }
    table.text()
}

/// The mark of what is within the reference's noise.
fn star(is_marked: bool) -> &'static str {
    if is_marked { "\\*" } else { "" }
}

fn errors(error: &Comparison, is_marked: bool) -> [String; 5] {
    let star = star(is_marked);
    [
        number(error.mse) + star,
        number(error.relmse) + star,
        decibels(error.psnr) + star,
        error.ssim.map_or("–".into(), |s| format!("{s:.4}")),
        format!("{:.4}", error.flip),
    ]
}

fn bias(error: &Comparison) -> String {
    let percent = 100.0 * error.rel_bias;
    match error.bias_stderr {
        Some(stderr) if error.bias != 0.0 => {
            let stderr = (stderr * error.rel_bias / error.bias).abs() * 100.0;
            format!("{percent:+.3} ± {stderr:.3} %")
        }
        _ => format!("{percent:+.3} %"),
    }
}

fn over_time(report: &Report, subject: &SubjectReport) -> String {
    let mut table = by_time("variant (PSNR, dB)", report);
    for run in &subject.runs {
        let at = |seconds| {
            let point = run.points.iter().find(|p| p.asked_s == seconds)?;
            let star = star(point.within_reference_noise);
            Some(decibels(point.error.psnr) + star + &late(point))
        };
        table.by_time(report, run.variant.clone(), at);
    }
    table.text()
}

/// A remark on a picture that came late.
fn late(point: &Point) -> String {
    if point.is_late() {
        format!(" (at {:.2} s)", point.seconds)
    } else {
        String::new()
    }
}

fn similarity(report: &Report, subject: &SubjectReport) -> String {
    let mut table = by_time("variant (dB; SSIM)", report);
    let seen = subject.similarity.iter().filter(|s| !s.points.is_empty());
    for similarity in seen {
        let at = |seconds| {
            let point = similarity.points.iter().find(|p| p.asked_s == seconds)?;
            let ssim = point.ssim.map_or(String::new(), |s| format!("; {s:.4}"));
            Some(decibels(point.psnr) + &ssim)
        };
        table.by_time(report, similarity.variant.clone(), at);
    }
    format!(
        "\n## How alike the variants are\n\nPSNR and SSIM to the picture of non-caching after the \
         same time (the paper's Figure 4); its noise bounds them.\n{}",
        table.text()
    )
}

fn new_views(subject: &SubjectReport) -> String {
    let mut table = Table::new(&[
        "variant",
        "first picture after",
        "MSE",
        "PSNR",
        "PSNR, same rays",
        "bias of surfaces",
        "of the medium",
        "later",
    ]);
    for run in &subject.runs {
        let Some((first, later)) = run.new_view.split_first() else {
            continue;
        };
        let later = later.iter().map(|p| {
            let (mse, psnr) = (number(p.error.mse), decibels(p.error.psnr));
            format!("{:.2} s: {mse}, {psnr} dB", p.seconds)
        });
        let bias = |of: fn(&BiasApart) -> Option<f64>| {
            let bias = run.bias_apart.as_ref().and_then(of);
            bias.map_or("–".into(), |bias| format!("{:+.2} %", 100.0 * bias))
        };
        table.row([
            run.variant.clone(),
            format!("{:.1} ms", 1e3 * first.seconds),
            number(first.error.mse),
            decibels(first.error.psnr),
            run.same_rays
                .as_ref()
                .map_or("–".into(), |s| decibels(s.psnr)),
            bias(|apart| apart.surfaces),
            bias(|apart| apart.medium),
            later.collect::<Vec<_>>().join("; "),
        ]);
    }
    section(
        "A new view from a warm cache",
        "The cache that the run left is made as good for all views; then the camera comes from elsewhere to the scene's \
         view. The table has what a march shows at once, and then what a few more rays of each pixel and samples make of \
         it. The first march sees one ray of each pixel: compared with the same rays, converged without a cache, its own \
         errors are told apart from the edges that it misses.",
        table,
    )
}

fn frames(subject: &SubjectReport) -> String {
    let mut table = Table::new(&[
        "variant",
        "frames",
        "march, median",
        "p99",
        "frames/s",
        "from the camera's change on, median",
        "p99",
    ]);
    for run in &subject.runs {
        let Some(orbit) = &run.orbit else { continue };
        let ms = |ms: f64| format!("{ms:.2} ms");
        table.row([
            run.variant.clone(),
            orbit.frames.to_string(),
            ms(orbit.march_ms_median),
            ms(orbit.march_ms_p99),
            format!("{:.1}", 1e3 / orbit.march_ms_median),
            ms(orbit.frame_ms_median),
            ms(orbit.frame_ms_p99),
        ]);
    }
    let what = "A turn around the object, marched through the cache.";
    section("Frames", what, table)
}

fn passes(subject: &SubjectReport) -> String {
    let mut table = Table::new(&["variant", "pass", "on the device", "of the peak"]);
    for run in &subject.runs {
        for pass in &run.passes {
            let share = pass.peak_share.map(|share| 100.0 * share);
            table.row([
                run.variant.clone(),
                pass.name.clone(),
                format!("{:.0} ms", pass.gpu_ms_total),
                share.map_or("–".into(), |percent| format!("{percent:.1} %")),
            ]);
        }
    }
    section(
        "Passes",
        "Until the last picture. The share of the peak is that of the least time in which the device could do the work \
         that a pass counts: reads of the volume by tracking, texels of the picture, copied bytes.",
        table,
    )
}

fn memory(subject: &SubjectReport) -> String {
    let mut table = Table::new(&[
        "variant",
        "planned",
        "peak",
        "cache",
        "active nodes",
        "bytes per active node",
        "bytes per voxel",
        "paths/s",
        "reads per path",
    ]);
    let row = |run: &RunReport| {
        let cache = run.cache.as_ref();
        let or_none = |value: Option<String>| value.unwrap_or("–".into());
        [
            run.variant.clone(),
            human(run.memory.planned_bytes),
            human(run.memory.peak_bytes),
            or_none(cache.map(|c| human(c.bytes))),
            or_none(cache.map(|c| format!("{} of {}", c.active_cells, c.cells))),
            or_none(run.bytes_per_active_cell.map(|b| format!("{b:.2}"))),
            or_none(run.bytes_per_voxel.map(|b| format!("{b:.3}"))),
            number(run.paths_per_second),
            format!("{:.1}", run.lookups_per_path),
        ]
    };
    for run in &subject.runs {
        table.row(row(run));
    }
    section(
        "Memory and speed",
        "In device memory; paths and reads of the volume are those of the cache and of the picture.",
        table,
    )
}

fn cache_settings(settings: &[CacheSetting]) -> String {
    let mut table = Table::new(&[
        "cache",
        "PSNR",
        "without noise",
        "at least",
        "SSIM",
        "its relative error",
        "paths a node",
        "bytes per active node",
        "bytes per voxel",
        "of the paper's 56",
    ]);
    for setting in settings {
        let share = setting.bytes_per_voxel / PAPER_BYTES_PER_VOXEL;
        let beyond_noise = |psnr: fn(&WithoutNoise) -> f64| {
            let found = setting.without_noise.as_ref().map(psnr);
            found.map_or("–".into(), decibels)
        };
        table.row([
            setting.variant.clone(),
            setting.psnr.map_or("the measure".into(), decibels),
            beyond_noise(|w| w.psnr_without_noise),
            beyond_noise(|w| w.psnr_at_least),
            setting.ssim.map_or("–".into(), |s| format!("{s:.5}")),
            number(setting.relative_error),
            setting.paths_per_cell.to_string(),
            format!("{:.2}", setting.bytes_per_active_cell),
            format!("{:.3}", setting.bytes_per_voxel),
            format!("{:.2} %", 100.0 * share),
        ]);
    }
    section(
        "Cache settings",
        "The same view through each cache, against that through the whole one in 32 bits (the paper's \
         Table 1). The f16 cache has had the same paths; the others have paths of their own, so that \
         they differ by both caches' noise as well. Each has been filled twice, with other random numbers: \
         from the two follows the PSNR without noise, and *at least*, the PSNR if the mean square were larger by two \
         of its standard errors.",
        table,
    )
}

fn skipped(subject: &SubjectReport) -> String {
    let lines = subject.skipped.iter().map(|why| format!("- {why}\n"));
    if subject.skipped.is_empty() {
        String::new()
    } else {
        format!("\n## Not measured\n\n{}", lines.collect::<String>())
    }
}

/// A section with the table, or nothing if the table is empty.
fn section(title: &str, what: &str, table: Table) -> String {
    match table.rows {
        0 => String::new(),
        _ => format!("\n## {title}\n\n{what}\n{}", table.text()),
    }
}

const READING: &str = "
## How to read this

MSE and relMSE (d² over reference² + 0.01) are of linear radiance; PSNR, SSIM and FLIP of the display
picture, exposed, clipped and sRGB-encoded. They contain the reference's own noise. The bias of the mean
is that of the whole picture, with the standard error of both pictures' means; what a cache has wrong is
in all its pixels alike, so that the error is too small there. 1/(MSE·s) is that of the last picture;
it is constant where only noise is left. Times to 30 and 40 dB are read off between two pictures, PSNR as
linear in the time's logarithm. A cache is filled for its share of each span between two times, so that
its pictures are not quite as good as those of a render that fills it first.
";
