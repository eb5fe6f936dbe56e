//! `isolume bench`: how fast each variant gets how close to the right picture.
//!
//! Each variant renders once, without a break; pictures are taken at the given times, and taking them does not count.
//! A cache goes on being filled as the times go up, with the same share of each span as in a render of that length. A
//! picture at t seconds is therefore not quite as good as that of `isolume render --time t`, which has filled its
//! cache before the first sample.

mod bias;
mod cache_settings;
mod edits;
mod entrant_run;
mod entrants;
mod folder;
mod markdown;
mod measure;
mod plots;
mod reference;
mod report;
mod table;
mod warm;

use std::path::PathBuf;
use std::time::{Duration, Instant};

use super::{interruptible, open_scene};
use crate::cli::{BenchArgs, message};
use crate::compare::LinearImage;
use crate::engine::{Host, Peak, Picture, Progress, Run, Stop};
use crate::error::{Error, Result};
use crate::interrupt::{self, is_interrupted};
use crate::output::{Outputs, Provenance, check_inputs_stay, check_writable, say, seed_of};
use crate::scene::Opened;
use crate::scene::volume::Volume;
use entrant_run::References;
use entrants::{Entrant, Subject, subjects};
use folder::Folder;
use reference::{Rays, Reference};
use report::{Report, RunReport, SubjectReport};

/// Time for which a GPU is kept busy before its work is timed.
const WAKING: Duration = Duration::from_millis(500);

/// The report for scripts, and the one for people.
const REPORT: &str = "report.json";
const PAGE: &str = "report.md";

/// The state that all measurements of a bench share.
struct Bench<'a> {
    args: &'a BenchArgs,
    /// Seed of what is measured.
    seed: u32,
    host: Host,
    /// The device's peak rates; `None` if they cannot be measured.
    peak: Option<Peak>,
    volume: &'a Volume,
    /// Stops by which pictures are brightened before they are compared.
    exposure: f64,
    /// The times at which pictures are taken, in ascending order.
    seconds: Vec<Duration>,
    outputs: Outputs,
    // Declared last, so that it is dropped last: it is removed if it is empty.
    folder: Folder,
}

pub fn bench(args: &BenchArgs) -> Result<u8> {
    check_flags(args)?;
    let given = match &args.reference {
        Some(path) => Some(LinearImage::read(path)?),
        None => None,
    };
    let opened = open_scene(&args.scene, args.quiet)?;
    if let Some(given) = &given {
        reference::check_size(given, &opened.scene)?;
    }
    let host = Host::open(&args.gpu.host_options())?;
    let subjects = subjects(args, &host, &opened)?;
    let folder = Folder::make(&args.folder)?;
    check_writable(&[folder.file(REPORT), folder.file(PAGE)])?;
    let inputs = opened.inputs()?.into_iter().chain(args.reference.clone());
    let pictures = subjects
        .iter()
        .flat_map(|subject| subject.files(&args.seconds(), given.is_some()));
    let pictures: Vec<PathBuf> = pictures.map(|name| folder.file(&name)).collect();
    check_inputs_stay(&pictures, &inputs.collect::<Vec<_>>())?;
    let mut bench = Bench {
        args,
        seed: seed(args),
        peak: host.peak().ok(),
        host,
        volume: &opened.volume,
        exposure: opened.scene.render.exposure,
        seconds: args.seconds(),
        outputs: Outputs::default(),
        folder,
    };
    interrupt::finish_on_interrupt();
    let mut measured = Vec::new();
    for subject in &subjects {
        match bench.measure(subject, given.as_ref()) {
            // What was measured before is there all the same.
            Err(Error::Interrupted) if !measured.is_empty() => break,
            subject => measured.push(subject?),
        }
        if is_interrupted() {
            break;
        }
    }
    bench.host.check_validation()?;
    bench.finish(&opened, measured)?;
    Ok(interrupt::status())
}

/// The seed of what is measured. A measurement with the reference's seed shares its samples, so that its error seems smaller
/// than it is.
fn seed(args: &BenchArgs) -> u32 {
    let of_reference = args.reference.as_deref().and_then(seed_of);
    match args.seed {
        Some(seed) => {
            if of_reference == Some(seed) && !args.quiet {
                say(format!(
                    "note: the reference has the same seed, {seed}; a picture that shares its samples seems better than it is"
                ));
            }
            seed
        }
        None => u32::from(of_reference == Some(0)),
    }
}

/// A run that waits for its first picture, even beyond its time: a first batch of paths may take longer than the first of
/// the given times.
fn patient_run(stop: Stop, progress: &mut dyn FnMut(Progress)) -> Run<'_> {
    Run {
        waits: true,
        ..interruptible(stop, progress)
    }
}

/// Fails for flags that other commands share, and that mean nothing here.
fn check_flags(args: &BenchArgs) -> Result<()> {
    let scene = &args.scene;
    let singular = [&scene.variant, &scene.cache_scale, &scene.cache_format];
    if singular.iter().any(|flag| flag.is_some()) {
        return Err(Error::Usage(
            "--variant, --cache-scale and --cache-format are for one render; bench takes them \
             together, as in --variants non-caching,caching:0.5:f16"
                .into(),
        ));
    }
    let models = args.shading().len();
    if args.reference.is_some() && models > 1 {
        return Err(Error::Usage(format!(
            "--reference is one picture, but --shading names {models} models; measure one at a time, or \
             leave --reference out"
        )));
    }
    Ok(())
}

impl Bench<'_> {
    /// Keeps a GPU busy for a while: one that has idled, while pictures were compared, is slow at first, which is no render's
    /// fault.
    fn wake(&self) {
        let began = Instant::now();
        let is_software = self.host.summary().kind.is_software();
        while !is_software && began.elapsed() < WAKING && self.host.peak().is_ok() {}
    }

    /// Writes a picture, one of a subject's [`files`](Subject::files), into the report's folder.
    fn write_picture(&mut self, name: &str, picture: &Picture, from: &Provenance) -> Result<()> {
        self.outputs.exr(&self.folder.file(name), picture, from)
    }

    /// A reference for pictures that a cache shows at once; `None` without one, or after an interruption.
    fn reference_of_centres(&mut self, subject: &Subject) -> Result<Option<Reference>> {
        if !subject.has_cache() || is_interrupted() {
            return Ok(None);
        }
        match Reference::render(self, subject, Rays::Centres) {
            Err(Error::Interrupted) => Ok(None),
            rendered => rendered.map(Some),
        }
    }

    /// All variants of one subject.
    fn measure(&mut self, subject: &Subject, given: Option<&LinearImage>) -> Result<SubjectReport> {
        let reference = match given {
            Some(image) => Reference::given(image, self)?,
            None => Reference::render(self, subject, Rays::Anywhere)?,
        };
        let centres = self.reference_of_centres(subject)?;
        let references = References {
            picture: &reference,
            centres: centres.as_ref(),
        };
        let mut runs: Vec<RunReport> = Vec::new();
        let mut uncached = Vec::new();
        let mut similarity = Vec::new();
        let mut skipped = subject.skipped.clone();
        for entrant in &subject.entrants {
            if is_interrupted() {
                break;
            }
            if self.may_skip(entrant)
                && let Err(why) = self.in_time(entrant, &runs)
            {
                skipped.push(why);
                continue;
            }
            self.say(&format!("{}{}", subject.prefix, entrant.word));
            let measured = measure::measure(self, subject, entrant, references);
            let (run, snapshots) = match measured {
                // What was measured before is worth a report all the same.
                Err(why @ Error::Memory(_)) if self.may_skip(entrant) => {
                    skipped.push(format!("{}: {}", entrant.word, message(&why)));
                    continue;
                }
                measured => measured?,
            };
            if entrant.choice.plan.variant.is_unbiased() {
                uncached = snapshots;
            } else if !uncached.is_empty() {
                similarity.push(measure::similarity(self, entrant, &uncached, &snapshots)?);
            }
            runs.push(run);
        }
        let cache_settings = if subject.has_cache() && !is_interrupted() {
            cache_settings::measure(self, subject, &runs, &mut skipped)?
        } else {
            Vec::new()
        };
        Ok(SubjectReport {
            shading: subject.shading,
            prefix: subject.prefix.clone(),
            reference: reference.report,
            reference_of_centres: centres.map(|centres| centres.report),
            runs,
            similarity,
            cache_settings,
            skipped,
        })
    }

    /// Writes all files, and says where.
    fn finish(self, opened: &Opened, subjects: Vec<SubjectReport>) -> Result<()> {
        let Bench {
            args,
            seed,
            host,
            folder,
            mut outputs,
            ..
        } = self;
        let report = Report::new(args, seed, &host, opened, subjects);
        let mut plotted = Vec::new();
        for subject in &report.subjects {
            for (name, svg) in plots::all(subject)? {
                let name = format!("{}{name}", subject.prefix);
                outputs.text(&folder.file(&name), &svg)?;
                plotted.push(name);
            }
        }
        outputs.json(&folder.file(REPORT), &report)?;
        outputs.text(&folder.file(PAGE), &markdown::page(&report, &plotted))?;
        outputs.commit()?;
        if !args.quiet {
            say(folder.file(PAGE).display());
        }
        Ok(())
    }

    /// Whether the report may do without a variant, and say why: the user has not named it, and it is not what the others are
    /// compared with.
    fn may_skip(&self, entrant: &Entrant) -> bool {
        self.args.variants().is_empty() && !entrant.choice.plan.variant.is_unbiased()
    }

    /// Whether each node of a cache can have a path before the last of the given times, at the speed of the caches so
    /// far, or else of any run; if not, the reason.
    fn in_time(&self, entrant: &Entrant, runs: &[RunReport]) -> Result<(), String> {
        let layout = entrant.choice.plan.variant.cache();
        let fastest = |cached: bool| {
            let like = runs.iter().filter(|run| run.cache.is_some() == cached);
            like.map(|run| run.paths_per_second).reduce(f64::max)
        };
        let (Some(layout), Some(rate)) = (layout, fastest(true).or(fastest(false))) else {
            return Ok(());
        };
        let needed = layout.active_nodes() as f64 / rate;
        if needed <= self.longest().as_secs_f64() {
            Ok(())
        } else {
            Err(format!(
                "{}: a path for each of its {} nodes takes {needed:.0} s or more; give --seconds a \
                 longer time",
                entrant.word,
                layout.active_nodes()
            ))
        }
    }

    fn say(&self, what: &str) {
        if !self.args.quiet {
            say(what);
        }
    }

    fn longest(&self) -> Duration {
        self.seconds.last().copied().unwrap_or_default()
    }
}
