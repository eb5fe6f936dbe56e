//! A render from top to bottom: load once, then unit after unit of samples.
//!
//! A unit gives every pixel the same number of new samples. Pictures are only taken at the end of a
//! unit: stopping a pixel in the middle of its work would favour its short paths.

use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::Duration;

use super::accumulate::Accumulate;
use super::cache::Cache;
use super::camera_march::CameraMarch;
use super::constants::SceneBuffers;
use super::copy;
use super::delta_tracking::DeltaTracking;
use super::iso_depth::IsoDepth;
use super::macrocell_ranges::MacrocellRanges;
use super::majorants::Majorants;
use super::published::Published;
use super::resources::Resources;
use super::shared::{self, AccumulatePush};
use crate::error::Result;
use crate::gpu::{Device, Frame, Memory, Shaders};
use crate::scene::volume::{Volume, Voxels};

pub struct Renderer {
    pub frame: Frame,
    pub totals: Totals,
    pub resources: Resources,
    /// What the compiling of all passes took.
    pub compiling: Duration,
    sampling: Sampling,
    accumulate: Accumulate,
    /// Only with surfaces.
    iso_depth: Option<IsoDepth>,
    /// Only in the variant that has one.
    pub cache: Option<Cache>,
}

/// How a picture at rest gets its samples.
enum Sampling {
    Tracking(DeltaTracking),
    March(CameraMarch),
    Published(Published),
}

/// What has been done so far.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct Totals {
    /// Samples in every pixel.
    pub samples: u32,
    /// Of which the spread between samples is known; `published` has a single one that grows.
    pub units: u32,
    pub paths: u64,
    /// Reads of the volume by tracking.
    pub lookups: u64,
}

/// The picture so far, row 0 on top.
pub struct Film {
    /// RGB and coverage.
    pub mean: Vec<[f32; 4]>,
    /// Standard error of the mean; infinite while there is a single unit.
    pub stderr: Vec<[f32; 3]>,
}

/// What the pixels' centres see of surfaces, row 0 on top.
pub struct FirstHits {
    /// Normal and, in w, distance along the ray; +∞ without a surface.
    pub normal_depth: Vec<[f32; 4]>,
    pub albedo: Vec<[f32; 4]>,
}

impl Renderer {
    pub fn new(memory: &Arc<Memory>, volume: &Volume, scene: &SceneBuffers) -> Result<Renderer> {
        let shaders = Shaders::new(shared::glsl())?;
        Renderer::with_shaders(memory, &shaders, volume, scene)
    }

    /// With passes compiled by `shaders`: a test may have put other text in the place of a file.
    pub fn with_shaders(
        memory: &Arc<Memory>,
        shaders: &Shaders,
        volume: &Volume,
        scene: &SceneBuffers,
    ) -> Result<Renderer> {
        let device = memory.device();
        let features = &scene.features;
        let mut renderer = Renderer {
            frame: Frame::new(device)?,
            totals: Totals::default(),
            resources: Resources::allocate(memory, volume, scene)?,
            compiling: Duration::ZERO,
            sampling: match scene.published {
                true => Sampling::Published(Published::new(device, shaders, scene)?),
                false if features.is_marched() => {
                    Sampling::March(CameraMarch::new(device, shaders, features)?)
                }
                false => Sampling::Tracking(DeltaTracking::new(device, shaders, features)?),
            },
            accumulate: Accumulate::new(device, shaders, features)?,
            iso_depth: match features.surface_count {
                0 => None,
                _ => Some(IsoDepth::new(device, shaders, features)?),
            },
            cache: match scene.cache {
                Some(_) => Some(Cache::new(device, shaders, features)?),
                None => None,
            },
        };
        renderer.load(device, shaders, volume, scene)?;
        renderer.compiling = shaders.time_spent();
        Ok(renderer)
    }

    /// Brings the scene onto the GPU: voxels, macrocells, majorants, and what the pixels' centres see.
    fn load(
        &mut self,
        device: &Arc<Device>,
        shaders: &Shaders,
        volume: &Volume,
        scene: &SceneBuffers,
    ) -> Result<()> {
        let r = &mut self.resources;
        self.frame.run(|f| {
            f.adopt(&r.images())?;
            f.clear(&r.images_from_zero())
        })?;
        let voxels: &[u8] = match &volume.voxels {
            Voxels::U8(v) => v,
            Voxels::U16(v) => bytemuck::cast_slice(v),
            Voxels::F32(v) => bytemuck::cast_slice(v),
        };
        let frame = &mut self.frame;
        copy::upload(frame, &mut r.staging, &r.volume, voxels)?;
        upload_transfer(frame, r, scene)?;
        let texels: Vec<[f32; 4]> = scene
            .environment
            .texels
            .iter()
            .map(|&[r, g, b]| [r, g, b, 1.0])
            .collect();
        copy::upload(
            frame,
            &mut r.staging,
            &r.environment,
            bytemuck::cast_slice(&texels),
        )?;
        let macrocell_ranges = MacrocellRanges::new(device, shaders, &scene.features)?;
        let majorants = Majorants::new(device, shaders, &scene.features)?;
        macrocell_ranges.run(frame, r)?;
        if scene.features.has_medium {
            majorants.run(frame, r)?;
        }
        if let (Some(iso_depth), Some(to)) = (&self.iso_depth, &r.first_surface) {
            iso_depth.run(frame, r, to)?;
        }
        if let (Some(cache), Some(layout)) = (&r.cache, &scene.cache) {
            let pages = layout.pages();
            copy::upload(
                frame,
                &mut r.staging,
                &cache.pages,
                bytemuck::cast_slice(&pages),
            )?;
        }
        Cache::prepare(device, shaders, &scene.features, frame, r)
    }

    /// Goes on with another scene of the same volume, sky image, picture size and features, and as many
    /// suns, surfaces, clip planes and transfer points; `before` is the one so far. Returns whether
    /// the cache's light is still right; if not, it is gone.
    pub fn change(&mut self, before: &SceneBuffers, scene: &SceneBuffers) -> Result<bool> {
        let r = &mut self.resources;
        r.write(scene);
        let device = self.frame.device();
        // A compiler takes a while to start, and a camera needs none.
        let shaders = || Shaders::new(shared::glsl());
        if before.transfer != scene.transfer || before.constants.density != scene.constants.density
        {
            upload_transfer(&mut self.frame, r, scene)?;
            Majorants::new(&device, &shaders()?, &scene.features)?.run(&mut self.frame, r)?;
        }
        if let (Some(iso_depth), Some(to)) = (&self.iso_depth, &r.first_surface) {
            iso_depth.run(&mut self.frame, r, to)?;
        }
        let lasts = before.shares_light_with(scene);
        if !lasts && let Some(cache) = &mut self.cache {
            cache.clear();
            Cache::prepare(&device, &shaders()?, &scene.features, &mut self.frame, r)?;
        }
        self.begin_picture()?;
        Ok(lasts)
    }

    /// Runs each pass for a moment and forgets what it did: some drivers finish compiling only then, and
    /// whoever measures does not want to measure that.
    pub fn warm_up(&mut self) -> Result<()> {
        let (frame, r) = (&mut self.frame, &self.resources);
        match &mut self.sampling {
            Sampling::Published(published) => {
                let never = AtomicBool::new(false);
                published.round(frame, r, &mut Totals::default(), &never)?;
                published.restart(frame, r)?;
            }
            Sampling::Tracking(tracking) => tracking.warm_up(frame, r)?,
            Sampling::March(march) => {
                if let Some(cache) = &r.cache {
                    march.run(frame, r, cache, 0)?;
                }
            }
        }
        if !matches!(self.sampling, Sampling::Published(_)) {
            let push = AccumulatePush {
                samples: 1.0,
                samples_so_far: 1.0,
            };
            frame.run(|f| self.accumulate.record(f, r, &push))?;
        }
        if let Some(cache) = &mut self.cache {
            cache.warm_up(frame, r)?;
        }
        self.begin_picture()
    }

    /// Forgets the picture's samples; the cache stays.
    pub fn begin_picture(&mut self) -> Result<()> {
        let r = &self.resources;
        self.totals.samples = 0;
        self.totals.units = 0;
        self.frame.run(|f| f.clear(&[&r.mean, &r.squares]))
    }

    /// A batch of `samples` paths for each node of the cache. False if `stop` is raised before its end.
    pub fn fill_cache(&mut self, samples: u32, stop: &AtomicBool) -> Result<bool> {
        match &mut self.cache {
            Some(cache) => cache.batch(&mut self.frame, &self.resources, samples, stop),
            None => Ok(true),
        }
    }

    /// The picture that the cache shows at once, row 0 on top.
    pub fn march(&mut self) -> Result<Vec<[f32; 4]>> {
        let r = &self.resources;
        if let Some(cache) = &self.cache {
            cache.march(&mut self.frame, r)?;
        }
        copy::download(&mut self.frame, &r.staging, &r.unit_sum)
    }

    /// Gives every pixel `samples` more samples. Returns false, and leaves the picture as it was, if
    /// `stop` is raised before the last path ends. In `published`, a unit is a round instead, whatever
    /// `samples` says.
    pub fn unit(&mut self, samples: u32, stop: &AtomicBool) -> Result<bool> {
        let frame = &mut self.frame;
        let r = &self.resources;
        match &mut self.sampling {
            Sampling::Published(published) => published.round(frame, r, &mut self.totals, stop),
            Sampling::Tracking(tracking) => {
                let first = self.totals.samples;
                let Some(lookups) = tracking.unit(frame, r, samples, first, stop)? else {
                    return Ok(false);
                };
                self.totals.lookups += lookups;
                self.accumulate(samples)?;
                Ok(true)
            }
            Sampling::March(_) => self.march_samples(samples, stop),
        }
    }

    /// Each sample is a unit of its own, which keeps those before it.
    fn march_samples(&mut self, samples: u32, stop: &AtomicBool) -> Result<bool> {
        for sample in 0..samples {
            if stop.load(Ordering::Relaxed) {
                return Ok(sample > 0);
            }
            if let (Sampling::March(march), Some(cache)) = (&self.sampling, &self.resources.cache) {
                let first = self.totals.samples;
                march.run(&mut self.frame, &self.resources, cache, first)?;
            }
            self.accumulate(1)?;
        }
        Ok(true)
    }

    /// Folds the unit that has just ended into the picture.
    fn accumulate(&mut self, samples: u32) -> Result<()> {
        let r = &self.resources;
        let [width, height, _] = r.mean.desc.extent;
        self.totals.samples += samples;
        self.totals.units += 1;
        self.totals.paths += samples as u64 * width as u64 * height as u64;
        let push = AccumulatePush {
            samples: samples as f32,
            samples_so_far: self.totals.samples as f32,
        };
        self.frame.run(|f| self.accumulate.record(f, r, &push))
    }

    /// Whether a picture at rest is marched.
    pub fn is_marched(&self) -> bool {
        matches!(self.sampling, Sampling::March(_))
    }

    /// Paths traced, for the cache and for the picture.
    pub fn paths(&self) -> u64 {
        self.totals.paths + self.cache.as_ref().map_or(0, |c| c.paths)
    }

    /// Reads of the volume by them.
    pub fn lookups(&self) -> u64 {
        self.totals.lookups + self.cache.as_ref().map_or(0, |c| c.lookups)
    }

    /// The picture after the last whole unit.
    pub fn film(&mut self) -> Result<Film> {
        let r = &self.resources;
        let frame = &mut self.frame;
        if let Sampling::Published(published) = &self.sampling {
            published.march(frame, r)?;
        }
        let mean = copy::download(frame, &r.staging, &r.mean)?;
        let squares = copy::download(frame, &r.staging, &r.squares)?;
        let divisor = (self.totals.units.saturating_sub(1)) as f32 * self.totals.samples as f32;
        let shared = self.shared_error(&mean);
        let stderr = squares.iter().zip(&mean).map(|(s, m)| {
            std::array::from_fn(|c| match self.totals.units {
                0 | 1 => f32::INFINITY,
                _ if m[3] == 0.0 => (s[c] / divisor).max(0.0).sqrt(),
                _ => (s[c] / divisor).max(0.0).sqrt().hypot(shared * m[c] * m[3]),
            })
        });
        let stderr = stderr.collect();
        Ok(Film { mean, stderr })
    }

    /// The cache's own error, which is in all samples alike, as a share of what each pixel covers: so
    /// large that its rms over the picture is what was measured.
    fn shared_error(&self, mean: &[[f32; 4]]) -> f32 {
        let Some(cache) = &self.cache else {
            return 0.0;
        };
        let covered = mean.iter().flat_map(|m| [0, 1, 2].map(|c| m[c] * m[3]));
        let squares: f64 = covered.map(|x| f64::from(x).powi(2)).sum();
        let rgb = mean.iter().flat_map(|m| [m[0], m[1], m[2]]);
        let brightness: f64 = rgb.map(f64::from).sum();
        let count = 3.0 * mean.len() as f64;
        let rms = (squares / count).sqrt();
        match rms > 0.0 {
            true => (cache.relative_error * brightness / count / rms) as f32,
            false => 0.0,
        }
    }

    pub fn first_hits(&mut self) -> Result<FirstHits> {
        let r = &self.resources;
        let [width, height, _] = r.mean.desc.extent;
        let pixels = width as usize * height as usize;
        Ok(match &r.first_surface {
            Some(surface) => FirstHits {
                normal_depth: copy::download(&mut self.frame, &r.staging, &surface.normal_depth)?,
                albedo: copy::download(&mut self.frame, &r.staging, &surface.albedo)?,
            },
            None => FirstHits {
                normal_depth: vec![[0.0, 0.0, 0.0, f32::INFINITY]; pixels],
                albedo: vec![[0.0; 4]; pixels],
            },
        })
    }
}

fn upload_transfer(frame: &mut Frame, r: &mut Resources, scene: &SceneBuffers) -> Result<()> {
    let texels = scene.transfer_texels();
    match texels.is_empty() {
        true => Ok(()),
        false => copy::upload(
            frame,
            &mut r.staging,
            &r.transfer,
            bytemuck::cast_slice(&texels),
        ),
    }
}
