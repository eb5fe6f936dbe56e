//! The environment image: where a direction lies in it, and that directions are drawn with the
//! density that they are said to have.

use crate::support::oracle;
use std::f64::consts::{PI, TAU};

use glam::DVec3;
use isolume::scene::EnvironmentImage;

use super::statistics::{assert_fits, assert_mean};
use super::*;

const SKY: Shader = Shader {
    name: "sky",
    text: include_str!("../../support/glsl/sky.comp"),
    uses: &["scene_block", "lights"],
};

const SAMPLES: usize = 1 << 20;

struct Sky {
    probe: Probe,
    image: EnvironmentImage,
    random: fastrand::Rng,
}

impl Sky {
    fn new(image: EnvironmentImage) -> Sky {
        let mut scene = scene();
        scene.lights.environment.image = Some(image.clone());
        Sky {
            probe: probe(&scene),
            image,
            random: fastrand::Rng::with_seed(6),
        }
    }

    fn run(&mut self, inputs: &[SkyInput]) -> Vec<SkyOutput> {
        self.run_shader(&SKY, inputs)
    }

    fn run_shader(&mut self, shader: &Shader, inputs: &[SkyInput]) -> Vec<SkyOutput> {
        let push = CountPush {
            count: inputs.len() as u32,
        };
        self.probe
            .run(shader, &push, inputs, inputs.len(), inputs.len())
    }

    fn unit(&mut self) -> f32 {
        (self.random.u32(..) >> 8) as f32 * 2f32.powi(-24)
    }

    fn input(&mut self, direction: DVec3) -> SkyInput {
        SkyInput {
            direction: direction.as_vec3().to_array(),
            u: [self.unit(), self.unit()],
            word: self.random.u32(..),
            pick: self.unit(),
        }
    }

    fn samples(&mut self) -> Vec<SkyOutput> {
        let inputs: Vec<SkyInput> = (0..SAMPLES).map(|_| self.input(DVec3::NEG_Z)).collect();
        self.run(&inputs)
    }

    fn looking(&mut self, directions: &[DVec3]) -> Vec<SkyOutput> {
        let inputs: Vec<SkyInput> = directions.iter().map(|&d| self.input(d)).collect();
        self.run(&inputs)
    }

    /// Of the sampling table.
    fn cells(&self) -> [usize; 2] {
        self.probe.constants.image_cells.map(|n| n as usize)
    }

    fn at(&self, direction: DVec3) -> DVec3 {
        let (u, v) = position(direction);
        radiance_at(&self.image, u, v)
    }
}

/// Interpolated between texels, round and round along u, constant beyond the first and the last row.
fn radiance_at(image: &EnvironmentImage, u: f64, v: f64) -> DVec3 {
    let x = u * f64::from(image.width) - 0.5;
    let y = v * f64::from(image.height) - 0.5;
    let texel = |dx: f64, dy: f64| {
        let i = (x.floor() + dx).rem_euclid(f64::from(image.width)) as usize;
        let j = (y.floor() + dy).clamp(0.0, f64::from(image.height - 1)) as usize;
        let texel = image.texels[j * image.width as usize + i];
        DVec3::from_array(texel.map(f64::from))
    };
    let row = |dy: f64| texel(0.0, dy).lerp(texel(1.0, dy), x - x.floor());
    row(0.0).lerp(row(1.0), y - y.floor())
}

/// As the contract has it.
fn position(d: DVec3) -> (f64, f64) {
    let u = 0.5 + d.x.atan2(-d.z) / TAU;
    (u, d.y.clamp(-1.0, 1.0).acos() / PI)
}

fn direction(u: f64, v: f64) -> DVec3 {
    let (azimuth, polar) = (TAU * (u - 0.5), PI * v);
    DVec3::new(
        polar.sin() * azimuth.sin(),
        polar.cos(),
        -polar.sin() * azimuth.cos(),
    )
}

fn noise(width: u32, height: u32) -> EnvironmentImage {
    let mut random = fastrand::Rng::with_seed(7);
    let texels = (0..width * height).map(|_| [(); 3].map(|()| 4.0 * random.f32().powi(4)));
    EnvironmentImage {
        width,
        height,
        texels: texels.collect(),
    }
}

/// Black but for one texel.
fn star(width: u32, height: u32, column: u32, row: u32) -> EnvironmentImage {
    let mut texels = vec![[0.0; 3]; (width * height) as usize];
    texels[(row * width + column) as usize] = [3.0, 20.0, 100.0];
    EnvironmentImage {
        width,
        height,
        texels: texels.into(),
    }
}

/// In the middle, at both poles, on both sides of the seam, and in an image with more texels than
/// the table has cells.
fn images() -> Vec<(String, EnvironmentImage)> {
    let mut images = vec![
        ("noise".to_string(), noise(64, 32)),
        ("odd noise".to_string(), noise(37, 11)),
        ("a column".to_string(), noise(1, 4)),
    ];
    for (column, row) in [(20, 12), (5, 0), (40, 31), (0, 16), (63, 9)] {
        images.push((
            format!("star at {column}, {row}"),
            star(64, 32, column, row),
        ));
    }
    images.push(("large star".to_string(), star(1500, 700, 1499, 350)));
    images
}

#[test]
fn directions_lie_where_the_contract_says() {
    let mut sky = Sky::new(noise(64, 32));
    let named = [
        (DVec3::NEG_Z, [0.5, 0.5]),
        (DVec3::X, [0.75, 0.5]),
        (DVec3::NEG_X, [0.25, 0.5]),
        (DVec3::new(1e-3, 0.0, 1.0), [1.0, 0.5]),
        (DVec3::new(-1e-3, 0.0, 1.0), [0.0, 0.5]),
        (DVec3::Y, [0.5, 0.0]),
        (DVec3::NEG_Y, [0.5, 1.0]),
        (DVec3::new(0.0, 1.0, -1.0), [0.5, 0.25]),
    ];
    let directions: Vec<DVec3> = named.iter().map(|n| n.0.normalize()).collect();
    for (found, (d, expected)) in sky.looking(&directions).iter().zip(named) {
        let off = (0..2).map(|a| (found.position[a] - expected[a]).abs());
        let off = off.fold(0.0, f32::max);
        assert!(
            off < 2e-4,
            "{d}: {:?}, expected {expected:?}",
            found.position
        );
    }
}

/// Bilinear, wrapping at the seam and clamped at the poles.
#[test]
fn the_filtered_image_is_the_scenes() {
    let mut random = oracle::random::Random::new(8, 0);
    for (name, image) in images() {
        let mut sky = Sky::new(image);
        let directions: Vec<DVec3> = (0..50_000)
            .map(|_| random.direction().as_vec3().as_dvec3())
            .collect();
        let brightest = sky
            .image
            .texels
            .iter()
            .flatten()
            .fold(0.0, |a: f32, &b| a.max(b));
        // Texels that single precision's angles are off by.
        let angle = 4e-7 * f64::from(sky.image.width.max(sky.image.height));
        for (found, &d) in sky.looking(&directions).iter().zip(&directions) {
            assert_eq!(found.lost, [0.0; 3], "{name}, {d}");
            let found = DVec3::from_array(found.image.map(f64::from));
            let off = (found - sky.at(d)).abs().max_element();
            let allowed = f64::from(brightest) * (1e-6 + 4.0 * angle / d.y.acos().sin());
            assert!(
                off < allowed,
                "{name}, {d}: {found}, expected {}",
                sky.at(d)
            );
        }
    }
}

#[test]
fn samples_are_distributed_as_their_density_says() {
    for (name, image) in images() {
        let mut sky = Sky::new(image);
        let [columns, rows] = sky.cells();
        let middle = |n: usize, count: usize| (n as f64 + 0.5) / count as f64;
        let cells: Vec<DVec3> = (0..columns * rows)
            .map(|c| direction(middle(c % columns, columns), middle(c / columns, rows)))
            .collect();
        let mut bins: Vec<(f64, f64)> = Vec::new();
        for (c, found) in sky.looking(&cells).iter().enumerate() {
            let polar = |row: usize| PI * row as f64 / rows as f64;
            let row = c / columns;
            let solid_angle = TAU / columns as f64 * (polar(row).cos() - polar(row + 1).cos());
            bins.push((0.0, f64::from(found.density) * solid_angle * SAMPLES as f64));
        }
        let samples = sky.samples();
        for sample in &samples {
            let (u, v) = position(DVec3::from_array(sample.sampled.map(f64::from)));
            let column = ((u * columns as f64) as usize).min(columns - 1);
            let row = ((v * rows as f64) as usize).min(rows - 1);
            bins[row * columns + column].0 += 1.0;
        }
        assert_fits(&name, &bins);
        // What a sample says of itself is what is said of its direction, but for cells' borders.
        let directions: Vec<DVec3> = samples[..100_000]
            .iter()
            .map(|s| DVec3::from_array(s.sampled.map(f64::from)))
            .collect();
        let again = sky.looking(&directions);
        let differ = again
            .iter()
            .zip(&samples)
            .filter(|(a, s)| a.density != s.sampled_density)
            .count();
        assert!(differ < 100, "{name}: {differ} densities are other cells'");
    }
}

/// Vulkan lets a device's cosine be off by 1/2048. Directions may then be turned by that, but rows of cells keep their size:
/// that of a pole is no more than a few such steps.
#[test]
fn a_coarse_cosine_leaves_heights_as_they_are() {
    let mut sky = Sky::new(noise(64, 32));
    let inputs: Vec<SkyInput> = (0..10_000).map(|_| sky.input(DVec3::NEG_Z)).collect();
    let coarse = "#version 460\n#define cos(x) (cos(x) + 1.0 / 2048.0)";
    let shader = Shader {
        text: SKY.text.replacen("#version 460", coarse, 1).leak(),
        ..SKY
    };
    let exact = sky.run(&inputs);
    let found = sky.run_shader(&shader, &inputs);
    for (found, exact) in found.iter().zip(&exact) {
        assert_eq!(found.sampled[1], exact.sampled[1]);
    }
    let is_turned = found
        .iter()
        .zip(&exact)
        .any(|(f, e)| f.sampled != e.sampled);
    assert!(is_turned, "the cosine was not coarse");
}

/// The mean of radiance over density is the integral of the image over the sphere, whatever the
/// density: only directions that are never drawn would be missing.
#[test]
fn samples_add_up_to_the_whole_sky() {
    for (name, image) in images() {
        // Nodes for each texel; those of a large image are many all the same.
        let nodes = if image.width > 100 { 4 } else { 16 };
        let mut sky = Sky::new(image);
        let samples = sky.samples();
        let (columns, rows) = (
            sky.image.width as usize * nodes,
            sky.image.height as usize * nodes,
        );
        let mut whole = DVec3::ZERO;
        for row in 0..rows {
            let polar = |r: f64| (PI * r / rows as f64).cos();
            let weight = TAU / columns as f64 * (polar(row as f64) - polar(row as f64 + 1.0));
            for column in 0..columns {
                let (u, v) = (column as f64 + 0.5, row as f64 + 0.5);
                whole += weight * radiance_at(&sky.image, u / columns as f64, v / rows as f64);
            }
        }
        for channel in 0..3 {
            let radiance = samples
                .iter()
                .map(|s| f64::from(s.sampled_radiance[channel]));
            assert_mean(
                &format!("{name}, channel {channel}"),
                radiance,
                whole[channel],
            );
        }
    }
}

#[test]
fn the_density_follows_the_filtered_image() {
    const NODES: usize = 8;
    let mut sky = Sky::new(noise(64, 32));
    let [columns, rows] = sky.cells();
    assert_eq!([columns, rows], [64, 32]);
    // Per cell: the mean of the filtered image, which the table integrates exactly over u and v.
    let mut cells = Vec::new();
    let mut total = 0.0;
    for c in 0..columns * rows {
        let (column, row) = (c % columns, c / columns);
        let mut mean = 0.0;
        for node in 0..NODES * NODES {
            let along = |i: usize| (i as f64 + 0.5) / NODES as f64;
            let u = (column as f64 + along(node % NODES)) / columns as f64;
            let v = (row as f64 + along(node / NODES)) / rows as f64;
            mean += radiance_at(&sky.image, u, v).element_sum() / (NODES * NODES) as f64;
        }
        let polar = |r: usize| PI * r as f64 / rows as f64;
        total += mean * TAU / columns as f64 * (polar(row).cos() - polar(row + 1).cos());
        let middle = |n: usize, count: usize| (n as f64 + 0.5) / count as f64;
        cells.push((mean, direction(middle(column, columns), middle(row, rows))));
    }
    let directions: Vec<DVec3> = cells.iter().map(|c| c.1).collect();
    for (found, (mean, d)) in sky.looking(&directions).iter().zip(&cells) {
        let ratio = f64::from(found.density) * total / mean;
        assert!(
            (ratio - 1.0).abs() < 1e-3,
            "{d}: {ratio} of what it should be"
        );
    }
}

#[test]
fn wherever_light_comes_from_the_density_is_positive() {
    let mut random = oracle::random::Random::new(9, 0);
    for (name, image) in images() {
        let mut sky = Sky::new(image);
        let brightest = (0..sky.image.texels.len())
            .max_by(|&a, &b| sky.image.texels[a][0].total_cmp(&sky.image.texels[b][0]))
            .expect("a texel") as u32;
        let (width, height) = (sky.image.width, sky.image.height);
        // All over the brightest texel and the half texels around it, and anywhere.
        let mut near = || {
            let off = |i: u32, n: u32, r: f64| (f64::from(i) - 0.6 + 2.2 * r) / f64::from(n);
            let u = off(brightest % width, width, random.uniform());
            let v = off(brightest / width, height, random.uniform()).clamp(0.0, 1.0);
            direction(u, v)
        };
        let mut directions: Vec<DVec3> = (0..40_000).map(|_| near()).collect();
        directions.extend((0..40_000).map(|_| random.direction()));
        let mut lit = 0;
        for (found, d) in sky.looking(&directions).iter().zip(&directions) {
            if found.image.iter().any(|&c| c > 0.0) {
                lit += 1;
                assert!(found.density > 0.0, "{name}, {d}: {found:?}");
            }
        }
        assert!(lit > 20_000, "{name}: only {lit} directions are lit");
    }
}
