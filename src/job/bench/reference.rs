//! The picture with which all others are compared, and its own noise; and one of the same rays for the picture that a
//! cache shows at once, whose rays go through the middle of each pixel.

use std::time::Duration;

use super::bias::{Seen, seen};
use super::entrants::Subject;
use super::report::ReferenceReport;
use super::{Bench, patient_run};
use crate::cli::BenchVariant;
use crate::compare::{Comparison, LinearImage, compare_images};
use crate::engine::{Engine, Outcome, Stop, Stopwatch};
use crate::error::{Error, Location, Result};
use crate::output::Provenance;
use crate::output::progress::ProgressLine;
use crate::scene::{Scene, Variant};

/// Factor on the longest time that is measured, for which a reference is rendered.
const TIMES_AS_LONG: u32 = 4;

pub struct Reference {
    pub image: LinearImage,
    /// What its pixels show, if all rays went through their middles.
    pub seen: Option<Vec<Seen>>,
    pub report: ReferenceReport,
}

/// Where a reference's rays go through a pixel.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Rays {
    Anywhere,
    /// Through its middle, as those of the picture that a cache shows at once.
    Centres,
}

pub fn check_size(given: &LinearImage, scene: &Scene) -> Result<()> {
    let [width, height] = scene.render.size;
    if (given.width, given.height) == (width as usize, height as usize) {
        Ok(())
    } else {
        Err(Error::input(
            Location::file(&given.name),
            format!(
                "the reference has {}x{} pixels, the scene {width}x{height}; give --size {}x{}",
                given.width, given.height, given.width, given.height
            ),
        ))
    }
}

impl Reference {
    pub fn given(image: &LinearImage, bench: &Bench<'_>) -> Result<Reference> {
        let path = bench.args.reference.as_ref().expect("it was read");
        Ok(Reference {
            image: image.clone(),
            seen: None,
            report: ReferenceReport {
                file: path.display().to_string(),
                seconds: None,
                samples: None,
                noise: own_noise(image, bench.exposure)?,
            },
        })
    }

    /// Renders a reference without a cache, which would be biased, and with random numbers of its own.
    pub fn render(bench: &mut Bench<'_>, subject: &Subject, rays: Rays) -> Result<Reference> {
        let Bench {
            seed, host, volume, ..
        } = bench;
        let seed = seed.wrapping_add(1);
        let uncached = BenchVariant::without_cache(Variant::NonCaching);
        let entrant = subject.entrant(host, volume, &uncached)?;
        let mut engine = Engine::with_plan(host, volume, &entrant.scene, entrant.choice, seed)?;
        if rays == Rays::Centres {
            engine.sample_pixel_centres()?;
        }
        let name = subject.reference_file(rays);
        let time = bench.longest().saturating_mul(TIMES_AS_LONG);
        bench.say(&format!("{name}: {} s", time.as_secs_f64()));
        let outcome = render_for(time, bench, &mut engine)?;
        let picture = engine.picture()?;
        let device = bench.host.summary().name.clone();
        let provenance = Provenance::new(entrant.text, seed, device);
        bench.write_picture(&name, &picture, &provenance)?;
        let image = LinearImage::from_picture(&name, &picture);
        let seen = match rays {
            Rays::Anywhere => None,
            Rays::Centres => Some(seen(&picture.depth, &engine.film()?.mean)),
        };
        Ok(Reference {
            report: ReferenceReport {
                file: name,
                seconds: Some(outcome.took.as_secs_f64()),
                samples: Some(outcome.samples),
                noise: own_noise(&image, bench.exposure)?,
            },
            image,
            seen,
        })
    }
}

fn render_for(time: Duration, bench: &Bench<'_>, engine: &mut Engine) -> Result<Outcome> {
    let stop = Stop::after(time);
    let mut progress = ProgressLine::new(bench.args.quiet, stop);
    let mut show = |step| progress.show(step);
    let mut run = patient_run(stop, &mut show);
    let outcome = engine.sample(&mut run, &Stopwatch::started());
    progress.finish();
    outcome
}

/// The metrics of a picture that differs from the reference by as much noise as the reference states for itself.
/// `None` if the reference states none.
fn own_noise(reference: &LinearImage, exposure: f64) -> Result<Option<Comparison>> {
    let Some(stderr) = &reference.stderr else {
        return Ok(None);
    };
    let mut noise = Gaussian(0);
    let pixels = reference.rgb.iter().zip(stderr);
    let noisy = LinearImage {
        name: "the reference's noise".into(),
        // The channels of a pixel share their paths, and with them their errors.
        rgb: pixels
            .map(|(rgb, stderr)| {
                let deviate = noise.next();
                std::array::from_fn(|c| rgb[c] + stderr[c] * deviate)
            })
            .collect(),
        ..reference.clone()
    };
    compare_images(reference, &noisy, exposure).map(Some)
}

/// Normal deviates by Box and Muller, from the numbers of splitmix64
/// (Steele, Lea, Flood: "Fast splittable pseudorandom number generators", 2014).
struct Gaussian(u64);

impl Gaussian {
    fn next(&mut self) -> f32 {
        let radius = (-2.0 * self.uniform().ln()).sqrt();
        (radius * (std::f64::consts::TAU * self.uniform()).cos()) as f32
    }

    /// A uniform random number in (0, 1].
    fn uniform(&mut self) -> f64 {
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let mut z = self.0;
        z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        z ^= z >> 31;
        ((z >> 11) + 1) as f64 * (-53f64).exp2()
    }
}
