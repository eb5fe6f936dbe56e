//! The oracle: a path tracer for the CPU in double precision that estimates the transport model by
//! the most obvious means there are. Whatever the GPU does cleverly is judged against it.
//!
//! Free flights use one majorant for everything; directional lights are sampled at every event;
//! environments are met only by paths that escape; roulette, where paths have no limit, is unbiased.
//! Backgrounds other than the environment are not its business.

pub mod brdf;
pub mod field;
pub mod random;
pub mod surface;
pub mod tracking;

use field::Ray;
use glam::DVec3;
use isolume::scene::volume::Volume;
use isolume::scene::{Camera, Environment, EnvironmentImage, LightModel, Projection, Scene};
use random::Random;
use std::f64::consts::{PI, TAU};
use std::ops::Range;
use std::thread;
use surface::{Departure, Hit};

/// Row 0 on top.
#[derive(Debug, Clone)]
pub struct Picture {
    pub width: u32,
    pub mean: Vec<[f64; 3]>,
    /// Of each mean.
    pub stderr: Vec<[f64; 3]>,
}

impl Picture {
    /// Mean of all pixels and its standard error.
    pub fn average(&self) -> ([f64; 3], [f64; 3]) {
        let n = self.mean.len() as f64;
        let mean: DVec3 = self.mean.iter().map(|&m| DVec3::from(m)).sum();
        let variance: DVec3 = self.stderr.iter().map(|&s| DVec3::from(s).powf(2.0)).sum();
        ((mean / n).into(), (variance.powf(0.5) / n).into())
    }
}

/// `spp` ≥ 2 independent paths a pixel.
pub fn render(scene: &Scene, volume: &Volume, spp: u32, seed: u64) -> Picture {
    assert!(spp >= 2, "a standard error needs two samples");
    let [width, height] = scene.render.size;
    let world = World { scene, volume };
    let rows = |rows: Range<u32>| -> Vec<(DVec3, DVec3)> {
        rows.flat_map(|y| (0..width).map(move |x| (x, y)))
            .map(|(x, y)| world.pixel(x, y, spp, seed))
            .collect()
    };
    let pixels = thread::scope(|scope| {
        let upper = scope.spawn(|| rows(0..height / 2));
        let lower = rows(height / 2..height);
        let mut pixels = upper.join().expect("the other half of the picture");
        pixels.extend(lower);
        pixels
    });
    let (mean, stderr) = pixels
        .iter()
        .map(|&(m, s)| (m.to_array(), s.to_array()))
        .unzip();
    Picture {
        width,
        mean,
        stderr,
    }
}

#[derive(Clone, Copy)]
struct World<'a> {
    scene: &'a Scene,
    volume: &'a Volume,
}

/// A straight piece of a path.
#[derive(Clone, Copy)]
struct Leg {
    ray: Ray,
    left: Option<Departure>,
    sees_surfaces: bool,
}

/// What ends a leg that does not escape.
enum Event<'a> {
    Collision {
        direction: DVec3,
        g: f64,
        albedo: DVec3,
    },
    Reflection(Hit<'a>),
}

impl<'a> World<'a> {
    /// Mean and standard error.
    fn pixel(&self, x: u32, y: u32, spp: u32, seed: u64) -> (DVec3, DVec3) {
        let size = self.scene.render.size;
        let mut random = Random::new(seed, y as u64 * size[0] as u64 + x as u64);
        let (mut mean, mut squares) = (DVec3::ZERO, DVec3::ZERO);
        for n in 1..=spp {
            let (u, v) = (x as f64 + random.uniform(), y as f64 + random.uniform());
            let ray = camera_ray(&self.scene.camera, size, u, v);
            let change = self.radiance(ray, &mut random) - mean;
            mean += change / n as f64;
            squares += change * change * (n - 1) as f64 / n as f64;
        }
        (mean, (squares / (spp - 1) as f64 / spp as f64).powf(0.5))
    }

    /// One path's estimate of the radiance that arrives along a camera ray.
    fn radiance(&self, ray: Ray, random: &mut Random) -> DVec3 {
        let limit = self.scene.render.max_bounces;
        let (mut light, mut throughput) = (DVec3::ZERO, DVec3::ONE);
        let mut leg = Leg {
            ray,
            left: None,
            sees_surfaces: true,
        };
        let mut events = 0;
        loop {
            let Some((point, event)) = self.next_event(&leg, random) else {
                return light
                    + throughput * environment(&self.scene.lights.environment, leg.ray.direction);
            };
            events += 1;
            if limit > 0 && events > limit {
                return light;
            }
            for sun in &self.scene.lights.suns {
                let incoming = -DVec3::from(sun.direction);
                let seen = throughput * event.response(incoming) * DVec3::from(sun.irradiance);
                if seen != DVec3::ZERO {
                    light += seen * self.visibility(&self.leave(point, &event, incoming), random);
                }
            }
            let (incoming, weight) = event.sample(random);
            throughput *= weight;
            let strength = throughput.max_element();
            let survival = match limit {
                0 => (4.0 * strength).min(1.0),
                _ => f64::from(strength > 0.0),
            };
            if random.uniform() >= survival {
                return light;
            }
            throughput /= survival;
            leg = self.leave(point, &event, incoming);
        }
    }

    /// Where a leg ends: the nearer of the first reflection and the first collision.
    fn next_event(&self, leg: &Leg, random: &mut Random) -> Option<(DVec3, Event<'a>)> {
        let Scene {
            medium,
            surfaces,
            clips,
            ..
        } = self.scene;
        let ray = &leg.ray;
        let (t0, t1) = field::interval(self.volume, clips, ray)?;
        let hit = if leg.sees_surfaces {
            surface::first_hit(self.volume, surfaces, ray, (t0, t1), leg.left, random)
        } else {
            None
        };
        let end = hit.map_or(t1, |h| h.t);
        let collision = medium.as_ref().and_then(|medium| {
            let (t, albedo) = tracking::collision(self.volume, medium, ray, t0, end, random)?;
            let (direction, g) = (ray.direction, medium.g);
            Some((
                ray.at(t),
                Event::Collision {
                    direction,
                    g,
                    albedo,
                },
            ))
        });
        collision.or(hit.map(|hit| (ray.at(hit.t), Event::Reflection(hit))))
    }

    /// An estimate of the part of the light from infinity that arrives against a leg.
    fn visibility(&self, leg: &Leg, random: &mut Random) -> f64 {
        let Scene {
            medium,
            surfaces,
            clips,
            ..
        } = self.scene;
        let ray = &leg.ray;
        let Some((t0, t1)) = field::interval(self.volume, clips, ray) else {
            return 1.0;
        };
        let passing = if leg.sees_surfaces {
            surface::passing(self.volume, surfaces, ray, (t0, t1), leg.left)
        } else {
            1.0
        };
        match medium {
            Some(medium) if passing > 0.0 => {
                let volume = self.volume;
                passing * tracking::estimate_transmittance(volume, medium, ray, t0, t1, random)
            }
            _ => passing,
        }
    }

    /// Local light: once a path has scattered, surfaces do not exist for it.
    fn leave(&self, point: DVec3, event: &Event, direction: DVec3) -> Leg {
        let left = match event {
            Event::Collision { .. } => None,
            Event::Reflection(hit) => Some(hit.departure),
        };
        let sees_surfaces = self.scene.surfaces.light == LightModel::Full;
        Leg {
            ray: Ray {
                origin: point,
                direction,
            },
            left,
            sees_surfaces,
        }
    }
}

impl Event<'_> {
    /// Radiance sent back along the leg per irradiance from `incoming` on a plane facing it.
    fn response(&self, incoming: DVec3) -> DVec3 {
        match self {
            Event::Collision {
                direction,
                g,
                albedo,
            } => *albedo * tracking::phase(*g, direction.dot(incoming)),
            Event::Reflection(hit) => hit.reflectance(incoming),
        }
    }

    /// A direction from which light may arrive, and `response` over its density.
    fn sample(&self, random: &mut Random) -> (DVec3, DVec3) {
        match self {
            Event::Collision {
                direction,
                g,
                albedo,
            } => (tracking::scatter(*g, *direction, random), *albedo),
            Event::Reflection(hit) => hit.sample(random),
        }
    }
}

/// The ray through (u, v), in pixels from the picture's upper left corner.
pub fn camera_ray(camera: &Camera, size: [u32; 2], u: f64, v: f64) -> Ray {
    let eye = DVec3::from(camera.eye);
    let forward = (DVec3::from(camera.target) - eye).normalize();
    let right = forward.cross(camera.up.into()).normalize();
    let up = right.cross(forward);
    let [width, height] = size.map(f64::from);
    // In units of the picture's height, from its centre.
    let offset = (u - width / 2.0) / height * right + (height / 2.0 - v) / height * up;
    match camera.projection {
        Projection::Perspective { fov_y } => {
            let height = 2.0 * (fov_y.to_radians() / 2.0).tan();
            Ray {
                origin: eye,
                direction: (forward + height * offset).normalize(),
            }
        }
        Projection::Orthographic { height } => Ray {
            origin: eye + height * offset,
            direction: forward,
        },
    }
}

/// Radiance from the direction in which `direction` points.
pub fn environment(environment: &Environment, direction: DVec3) -> DVec3 {
    let image = environment
        .image
        .as_ref()
        .map(|image| lookup(image, direction));
    DVec3::from(environment.radiance) + image.unwrap_or(DVec3::ZERO)
}

fn lookup(image: &EnvironmentImage, d: DVec3) -> DVec3 {
    let u = 0.5 + d.x.atan2(-d.z) / TAU;
    let v = d.y.clamp(-1.0, 1.0).acos() / PI;
    let (x, y) = (u * image.width as f64 - 0.5, v * image.height as f64 - 0.5);
    let texel = |i: f64, j: f64| {
        let i = i.rem_euclid(image.width as f64) as usize;
        let j = j.clamp(0.0, image.height as f64 - 1.0) as usize;
        DVec3::from(image.texels[j * image.width as usize + i].map(f64::from))
    };
    let row = |j: f64| texel(x.floor(), j).lerp(texel(x.floor() + 1.0, j), x - x.floor());
    row(y.floor()).lerp(row(y.floor() + 1.0), y - y.floor())
}
