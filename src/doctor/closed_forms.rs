//! Scenes of a few voxels whose radiance is known exactly. Between them they use transmittance, scattering, the phase
//! function, surfaces and the cache; `tests/transport` holds the same engine to many more, and to tighter bounds.
//!
//! The first two repeat, in small, two errors that an NVIDIA H100 once made: it rounded positions between voxels, and its
//! compiler made code by which some rays missed surfaces.

use std::num::NonZeroU32;
use std::sync::Arc;
use std::time::{Duration, Instant};

use serde::Serialize;

use crate::engine::{Engine, Host, Picture, Stop};
use crate::error::{Error, Result};
use crate::scene::volume::{Volume, Voxels};
use crate::scene::{EnvironmentImage, Scene, SceneFile, resolve};

/// A number that was measured against one that is known, and what came of it.
#[derive(Debug, Serialize)]
pub struct ClosedForm {
    #[serde(flatten)]
    pub measurement: Measured,
    pub seconds: f64,
    /// Whether the measurement agrees with the exact number.
    pub holds: bool,
    /// Whether its standard error is small enough for that to mean something.
    pub decided: bool,
}

#[derive(Debug, Serialize)]
pub struct Measured {
    pub name: &'static str,
    pub exact: f64,
    pub measured: f64,
    /// Standard error of the measurement; where the cache or rounding decides, the tolerance is wider than that.
    pub stderr: f64,
    /// Largest difference that counts as agreement.
    pub tolerance: f64,
}

/// Errors of a cache, and of the noise of its nodes, which a picture's standard error does not know.
const CACHE_TOLERANCE: f64 = 0.01;
/// A measurement with a larger standard error, as a share of the exact number, decides nothing.
const CONCLUSIVE: f64 = 0.02;
/// Voxels by which the depth of a surface may be off.
const DEPTH_TOLERANCE: f64 = 1e-3;
/// Samples a pixel, and how long one scene may take for them.
const SAMPLES: NonZeroU32 = NonZeroU32::new(1024).unwrap();
const TIME: Duration = Duration::from_millis(1500);

/// Renders a scene and compares what is known of it, under the check's name.
type Check = fn(&Host, &'static str) -> Result<Vec<Measured>>;

/// The most telling first, since a slow device is not examined for ever, and those last whose passes take longest to compile.
const CHECKS: [(&str, Check); 8] = [
    ("surface in a medium under a sun", lit_surface),
    ("thin shell between two voxels", thin_shell),
    ("white surface in a white furnace", surface),
    ("slab that absorbs", absorption),
    ("slab under a sun, one scattering", single_scattering),
    ("white furnace", furnace),
    ("white furnace through the cache", cached_furnace),
    ("scattering slab through the cache", cached_slab),
];

/// Runs the checks one after another, and none that `until` is too soon for, judging by the slowest so far. Some drivers
/// take seconds to compile the passes of one scene. Adds the results to `forms`, and the names of the checks left out to
/// `left_out`, also if a later check fails.
pub fn check_all(
    host: &Host,
    until: Instant,
    forms: &mut Vec<ClosedForm>,
    left_out: &mut Vec<&'static str>,
) -> Result<()> {
    let mut slowest = Duration::ZERO;
    for (name, check) in CHECKS {
        let began = Instant::now();
        if began + slowest > until {
            left_out.push(name);
            continue;
        }
        let measured = unless_too_slow(check(host, name))?;
        slowest = slowest.max(began.elapsed());
        match measured {
            Some(measured) => {
                let seconds = began.elapsed().as_secs_f64() / measured.len() as f64;
                forms.extend(measured.into_iter().map(|m| m.judged(seconds)));
            }
            None => left_out.push(name),
        }
    }
    Ok(())
}

/// `None` where the device was too slow for the check's first sample.
fn unless_too_slow(checked: Result<Vec<Measured>>) -> Result<Option<Vec<Measured>>> {
    match checked {
        Err(Error::TooShort { .. }) => Ok(None),
        checked => checked.map(Some),
    }
}

impl Measured {
    /// The mean of red over the picture, whose pixels are independent.
    fn radiance(name: &'static str, picture: &Picture, exact: f64) -> Measured {
        let pixels = picture.rgb.len() as f64;
        let sum: f64 = picture.rgb.iter().map(|p| f64::from(p[0])).sum();
        let squares: f64 = picture.stderr.iter().map(|p| f64::from(p[0]).powi(2)).sum();
        let stderr = squares.sqrt() / pixels;
        Measured {
            name,
            exact,
            measured: sum / pixels,
            stderr,
            tolerance: 4.0 * stderr + 2e-4 * exact,
        }
    }

    fn judged(self, seconds: f64) -> ClosedForm {
        let holds = (self.measured - self.exact).abs() <= self.tolerance;
        let decided = self.stderr <= CONCLUSIVE * self.exact.abs();
        ClosedForm {
            measurement: self,
            seconds,
            holds,
            decided,
        }
    }

    /// The error of a cached picture is that of its nodes, which all pixels share: no mean over pixels makes it smaller.
    fn through_a_cache(mut self, picture: &Picture) -> Measured {
        self.stderr *= (picture.rgb.len() as f64).sqrt();
        self.tolerance = 4.0 * self.stderr + CACHE_TOLERANCE * self.exact;
        self
    }
}

/// A field that is 1 everywhere.
fn constant(dims: [u32; 3], spacing: [f64; 3]) -> Result<Volume> {
    let voxels = vec![1.0; dims.iter().product::<u32>() as usize];
    Volume::from_values(dims, spacing, Voxels::F32(voxels))
}

/// Thickness 1, and as good as infinitely wide.
fn slab(layers: u32) -> Result<Volume> {
    constant([2, layers, 2], [50.0, 1.0 / f64::from(layers), 50.0])
}

fn scene(text: &str, volume: &Volume) -> Result<Scene> {
    let file = SceneFile::parse(text, "doctor.toml".as_ref(), &[])?;
    Ok(resolve(&file, volume)?.0)
}

fn render(host: &Host, volume: &Volume, scene: &Scene, seed: u32) -> Result<Picture> {
    let mut engine = Engine::new(host, volume, scene, seed)?;
    engine.warm_up()?;
    engine.render(Stop {
        time: Some(TIME),
        ..Stop::at_samples(SAMPLES)
    })?;
    engine.picture()
}

const FROM_ABOVE: &str = "camera = { eye = [0.0, 20.0, 0.0], target = [0.0, 0.0, 0.0], up = [0.0, 0.0, 1.0], orthographic = 1.0 }\n";

/// e⁻² of the sky is left behind two mean free paths.
fn absorption(host: &Host, name: &'static str) -> Result<Vec<Measured>> {
    let volume = slab(1)?;
    let text = "render = { size = [32, 32], variant = \"non-caching\" }
        medium = { density = 2.0, transfer = [{ value = 0.0, color = [0.0, 0.0, 0.0] }] }\n";
    let scene = scene(&[FROM_ABOVE, text].concat(), &volume)?;
    let picture = render(host, &volume, &scene, 1)?;
    let measured = Measured::radiance(name, &picture, (-2.0f64).exp());
    Ok(vec![measured])
}

/// Light that falls straight down is seen at 60° to it: 10/4π · (1 − exp(−1 − 1/μ)) / (1 + μ) with μ = ½.
fn single_scattering(host: &Host, name: &'static str) -> Result<Vec<Measured>> {
    let volume = slab(1)?;
    let text = "render = { size = [32, 32], variant = \"non-caching\", max_bounces = 1 }
        medium = { density = 1.0, transfer = [{ value = 0.0 }] }
        light = [{ type = \"directional\", direction = [0.0, -1.0, 0.0], irradiance = [10.0, 10.0, 10.0] }]
        camera = { eye = [17.320508, 10.0, 0.0], target = [0.0, 0.0, 0.0], up = [0.0, 0.0, 1.0], orthographic = 1.0 }\n";
    let picture = render(host, &volume, &scene(text, &volume)?, 2)?;
    let exact = 10.0 / (4.0 * std::f64::consts::PI) * 2.0 / 3.0 * -(-3.0f64).exp_m1();
    let measured = Measured::radiance(name, &picture, exact);
    Ok(vec![measured])
}

const FURNACE: &str = "medium = { density = 8.0, transfer = [{ value = 0.0 }] }
    camera = { eye = [0.6, 0.8, 3.0], target = [0.0, 0.0, 0.0], up = [0.0, 1.0, 0.0], fov_y = 25.0 }\n";

/// Where nothing absorbs and the sky is 1 everywhere, so is the picture.
fn furnace(host: &Host, name: &'static str) -> Result<Vec<Measured>> {
    let volume = constant([12; 3], [1.0 / 12.0; 3])?;
    let text = "render = { size = [16, 16], variant = \"non-caching\" }\n";
    let scene = scene(&[text, FURNACE].concat(), &volume)?;
    let picture = render(host, &volume, &scene, 3)?;
    let measured = Measured::radiance(name, &picture, 1.0);
    Ok(vec![measured])
}

fn cached_furnace(host: &Host, name: &'static str) -> Result<Vec<Measured>> {
    let volume = constant([12; 3], [1.0 / 12.0; 3])?;
    let text = "render = { size = [16, 16], variant = \"caching\", cache_scale = 0.5, cache_format = \"f16\" }\n";
    let scene = scene(&[text, FURNACE].concat(), &volume)?;
    let picture = render(host, &volume, &scene, 5)?;
    let measured = Measured::radiance(name, &picture, 1.0).through_a_cache(&picture);
    Ok(vec![measured])
}

/// The radiance that a slab of optical depth 1 and albedo ½ reflects along its normal, under a sky of 1 above it and 0 below, by
/// adding–doubling (van de Hulst, *Multiple Light Scattering*, 1980).
const CACHED_SLAB: f64 = 0.099119;

/// A sky that is 1 above the horizon and 0 below, reflected by a slab of one mean free path and albedo ½.
fn cached_slab(host: &Host, name: &'static str) -> Result<Vec<Measured>> {
    const ROWS: usize = 256;
    let volume = slab(16)?;
    let text = "render = { size = [16, 16], variant = \"caching\", cache_scale = 1.0, cache_format = \"f32\" }
        medium = { density = 1.0, transfer = [{ value = 0.0, color = [0.5, 0.5, 0.5] }] }\n";
    let mut scene = scene(&[FROM_ABOVE, text].concat(), &volume)?;
    let row = |j| [if j < ROWS / 2 { 1.0 } else { 0.0 }; 3];
    scene.lights.environment.radiance = [0.0; 3];
    scene.lights.environment.image = Some(EnvironmentImage {
        width: 1,
        height: ROWS as u32,
        texels: (0..ROWS).map(row).collect::<Arc<[_]>>(),
    });
    let picture = render(host, &volume, &scene, 6)?;
    let measured = Measured::radiance(name, &picture, CACHED_SLAB).through_a_cache(&picture);
    Ok(vec![measured])
}

/// The voxels' values grow by one from each to the next along y.
fn ramp() -> Result<Volume> {
    const SIDE: usize = 16;
    let voxels = (0..SIDE.pow(3)).map(|i| (i / SIDE % SIDE) as f32);
    Volume::from_values(
        [SIDE as u32; 3],
        [1.0 / SIDE as f64; 3],
        Voxels::F32(voxels.collect()),
    )
}

/// A white surface in a white furnace is as bright as everything else. The plane V = 7.3 lies 7.8 voxels above the bottom,
/// at y = 7.8/16 − 1/2, and the eye at 2. The same samples taken again give the same bits.
fn surface(host: &Host, name: &'static str) -> Result<Vec<Measured>> {
    const VOXELS: f64 = 16.0;
    let volume = ramp()?;
    let text = "render = { size = [16, 16], variant = \"non-caching\" }
        medium = { density = 8.0, transfer = [{ value = 0.0 }] }
        surfaces = { light = \"full\", iso = [{ value = 7.3, color = [1.0, 1.0, 1.0] }] }
        camera = { eye = [0.0, 2.0, 0.0], target = [0.0, 0.0, 0.0], up = [0.0, 0.0, 1.0], orthographic = 0.9 }\n";
    let mut engine = Engine::new(host, &volume, &scene(text, &volume)?, 7)?;
    engine.warm_up()?;
    let mut picture_of_64_samples = || {
        engine.begin_picture();
        engine.render(Stop::at_samples(const { NonZeroU32::new(64).unwrap() }))?;
        engine.picture()
    };
    let picture = picture_of_64_samples()?;
    let again = picture_of_64_samples()?;
    let exact = 2.5 * VOXELS - 7.8;
    let depths = picture.depth.iter().map(|&depth| f64::from(depth) * VOXELS);
    let worst = depths.max_by(|a, b| (a - exact).abs().total_cmp(&(b - exact).abs()));
    let pixels = picture.rgb.iter().zip(&again.rgb);
    Ok(vec![
        Measured::radiance(name, &picture, 1.0),
        Measured {
            name: "depth of an isosurface, voxels",
            exact,
            measured: worst.unwrap_or(f64::NAN),
            stderr: 0.0,
            tolerance: DEPTH_TOLERANCE,
        },
        Measured {
            name: "pixels that differ the second time",
            exact: 0.0,
            measured: pixels.filter(|(a, b)| a != b).count() as f64,
            stderr: 0.0,
            tolerance: 0.0,
        },
    ])
}

/// A transfer function that is a narrow tent leaves e⁻¹ of the sky: extinction is 200 at its top and falls to 0 within a
/// hundredth of the way between two voxels, half a unit apart.
fn thin_shell(host: &Host, name: &'static str) -> Result<Vec<Measured>> {
    let volume = Volume::from_values([1, 2, 1], [50.0, 0.5, 50.0], Voxels::U8(vec![0, 100]))?;
    let text = "render = { size = [32, 32], variant = \"non-caching\" }
        [medium]
        density = 200.0
        transfer = [
            { value = 49.0, opacity = 0.0, color = [0.0, 0.0, 0.0] },
            { value = 50.0, opacity = 1.0, color = [0.0, 0.0, 0.0] },
            { value = 51.0, opacity = 0.0, color = [0.0, 0.0, 0.0] },
        ]\n";
    let picture = render(
        host,
        &volume,
        &scene(&[FROM_ABOVE, text].concat(), &volume)?,
        8,
    )?;
    let measured = Measured::radiance(name, &picture, (-1.0f64).exp());
    Ok(vec![measured])
}

/// Red of [`lit_surface_scene`]'s picture, from a long render (± 0.00003). A test compares it with the path tracer on the
/// CPU that the other tests trust.
#[doc(hidden)]
pub const LIT_SURFACE: f64 = 0.460244;

/// Hills of Lambert's reflectance in a medium, under a sun and a sky, in `local` light.
#[doc(hidden)]
pub fn lit_surface_scene() -> Result<(Volume, Scene)> {
    const SIDE: usize = 24;
    let value = |i: usize| {
        let [x, y, z] = [i % SIDE, i / SIDE % SIDE, i / SIDE / SIDE].map(|n| n as f64);
        let waves = (0.55 * x).sin() + (0.5 * y + 1.0).sin() * (0.45 * z).cos();
        (12000.0 * (2.0 + waves)).round() as u16
    };
    let values = (0..SIDE.pow(3)).map(value).collect();
    let volume = Volume::from_values([SIDE as u32; 3], [1.0; 3], Voxels::U16(values))?;
    let text = "render = { size = [32, 32], variant = \"non-caching\" }
        surfaces = { light = \"local\", iso = [{ value = 30000.5, color = [0.9, 0.45, 0.15] }] }
        camera = { eye = [14.0, 26.0, 44.0], target = [0.0, -1.0, 0.0], fov_y = 34.0 }
        [medium]
        density = 0.12
        transfer = [
            { value = 0.0, opacity = 0.05, color = [0.9, 0.9, 0.95] },
            { value = 60000.0, opacity = 1.0, color = [0.9, 0.9, 0.95] },
        ]
        [[light]]
        type = \"directional\"
        direction = [-0.9, -1.0, -0.2]
        irradiance = [4.0, 4.0, 3.6]
        [[light]]
        type = \"environment\"
        radiance = [0.15, 0.2, 0.35]\n";
    let scene = scene(text, &volume)?;
    Ok((volume, scene))
}

fn lit_surface(host: &Host, name: &'static str) -> Result<Vec<Measured>> {
    let (volume, scene) = lit_surface_scene()?;
    let picture = render(host, &volume, &scene, 9)?;
    let measured = Measured::radiance(name, &picture, LIT_SURFACE);
    Ok(vec![measured])
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::error::Lacking;

    /// Other checks go on; what else fails ends them.
    #[test]
    fn a_check_without_a_first_sample_is_left_out() {
        let too_short = Error::TooShort {
            time: TIME,
            spent: TIME,
            lacking: Lacking::Sample,
        };
        assert!(matches!(unless_too_slow(Err(too_short)), Ok(None)));
        assert!(unless_too_slow(Err(Error::value("wrong"))).is_err());
    }
}
