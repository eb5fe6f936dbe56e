//! Rules that stand in Rust and in GLSL, held against each other over their whole range.

use fastrand::Rng;
use isolume::gpu::*;
use isolume::output::display::display_value;
use isolume::render::shared::{self, BRICK, GATHERED, MACROCELL};
use isolume::render::{Batch, GpuScene, Renderer, ToneMapPush, Until, batch_gathers};
use isolume::scene::*;

use crate::support::common::*;
use crate::support::fields::indexed_field;

const SIDE: u32 = 64;

/// What `tone_map.comp` shows of radiances, red of each pixel, in 256ths.
fn shown(radiances: &[f32], exposure: f64, tone: Tone) -> Vec<u8> {
    let device = device();
    let memory = Memory::new(&device, 1 << 22).expect("memory");
    let image = |name, format| {
        let desc = ImageDesc::flat(name, [SIDE, SIDE], format)
            .written()
            .zeroed();
        Image::new(&memory, desc).expect("an image")
    };
    let picture = image("picture", Format::R32G32B32A32_SFLOAT);
    let to = image("shown", Format::R8G8B8A8_UNORM);
    let texels: Vec<[f32; 4]> = radiances.iter().map(|&r| [r, r, r, 1.0]).collect();
    let placement = Placement::HostCached;
    let staging = Buffer::with_data_in(&memory, "staging", placement, &texels);
    let staging = staging.expect("staging");
    let desc = PassDesc {
        name: "tone_map",
        specialization: &[],
        push: ToneMapPush::PUSH,
        macros: &[],
    };
    let shaders = Shaders::new(shared::glsl());
    let pass = Pass::new(&device, &shaders, &desc).expect("a pass");
    let push = ToneMapPush {
        source: [SIDE; 2],
        size: [SIDE; 2],
        exposure: exposure.exp2() as f32,
        filmic: (tone == Tone::Filmic) as u32,
    };
    let (low, extent) = ([0; 3], [SIDE, SIDE, 1]);
    let mut frame = Frame::new(&device).expect("a frame");
    let run = frame.run(|recording| {
        recording.upload(&staging, &picture, low, extent)?;
        let bindings = [
            ("picture", Binding::Image(&picture)),
            ("shown", Binding::Image(&to)),
        ];
        recording.dispatch(&pass, &bindings, &push, extent)?;
        recording.download(&to, &staging, low, extent)
    });
    run.expect("a run");
    assert_silent(&device);
    let texels = staging.read_vec::<[u8; 4]>(radiances.len());
    texels.into_iter().map(|texel| texel[0]).collect()
}

/// From 2⁻²⁰ to 2¹², and what no picture should hold.
#[test]
fn a_display_shows_what_a_png_holds() {
    let count = (SIDE * SIDE) as usize;
    let step = |n: usize| (-20.0 + 32.0 * n as f32 / count as f32).exp2();
    let mut radiances: Vec<f32> = (0..count - 3).map(step).collect();
    radiances.extend([0.0, -1.0, f32::INFINITY]);
    for (exposure, tone) in [
        (0.0, Tone::Linear),
        (2.5, Tone::Linear),
        (0.0, Tone::Filmic),
        (-1.5, Tone::Filmic),
    ] {
        let shown = shown(&radiances, exposure, tone);
        for (&radiance, shown) in radiances.iter().zip(shown) {
            let exact = 255.0 * display_value(radiance.into(), exposure, tone);
            let difference = (f64::from(shown) - exact).abs();
            assert!(
                difference < 0.51,
                "{tone:?}: {radiance} is {exact}, shown as {shown}"
            );
        }
    }
}

/// The majorants of all macrocells, as the GPU has them.
fn majorants(renderer: &mut Renderer) -> Vec<f32> {
    let (frame, r) = renderer.probed();
    let [x, y, z] = r.majorants.desc().extent;
    let run =
        frame.run(|recording| recording.download(&r.majorants, &r.staging, [0; 3], [x, y, z]));
    run.expect("a download");
    r.staging.read_vec((x * y * z) as usize)
}

/// Large parts of a scan have exactly this value.
const BACKGROUND: f32 = -70.0;

/// The cache has memory where the CPU finds that a macrocell scatters, and paths collide where the GPU finds it.
#[test]
fn cpu_and_gpu_agree_on_where_the_medium_scatters() {
    let mut random = Rng::with_seed(3);
    let dims = [40, 33, 25];
    let mut scattering = [0usize; 2];
    for trial in 0..9usize {
        let volume = indexed_field(dims, [1.0; 3], |[x, ..]| {
            let wave = (0.13 * f64::from(x) + 0.2 * trial as f64).sin();
            (100.0 * wave + 4.0 * random.f64()).max(f64::from(BACKGROUND)) as f32
        });
        let mut value = [-110.0, f64::from(BACKGROUND)][trial % 2];
        let transfer = (0..6).map(|_| {
            // Some points share a value, which makes a step, and half of them are empty.
            value += [0.0, 15.0, 60.0][random.usize(0..3)];
            let opacity = [0.0, 0.0, 0.3, 1.0][random.usize(0..4)];
            TransferPoint {
                value,
                opacity,
                color: [0.9; 3],
            }
        });
        // One ramp for all values, which begins at the background.
        let ramp =
            [(f64::from(BACKGROUND), 0.0), (149.0, 1.0)].map(|(value, opacity)| TransferPoint {
                value,
                opacity,
                color: [0.9; 3],
            });
        let transfer = match trial {
            8 => ramp.to_vec(),
            _ => transfer.collect(),
        };
        let camera = Camera {
            eye: [0.0, 0.0, 90.0],
            target: [0.0; 3],
            up: [0.0, 1.0, 0.0],
            projection: Projection::Perspective { fov_y: 30.0 },
        };
        let mut scene = empty_scene([8, 8], camera);
        scene.medium = Some(Medium::isotropic(0.7, transfer));
        let device = device();
        let memory = Memory::new(&device, BUDGET).expect("memory");
        let scene = GpuScene::new(&scene, &volume, 1);
        assert_eq!(
            scene.parts.medium.block_size, MACROCELL,
            "a block is a macrocell"
        );
        let occupied = scene.occupancy(&volume).occupied;
        let mut renderer = Renderer::new(&memory, &volume, scene).expect("a renderer");
        let majorants = majorants(&mut renderer);
        assert_eq!(majorants.len(), occupied.len());
        for (n, (&majorant, occupied)) in majorants.iter().zip(occupied).enumerate() {
            assert_eq!(
                majorant > 0.0,
                occupied,
                "trial {trial}, macrocell {n}: {majorant}"
            );
            scattering[usize::from(occupied)] += 1;
        }
        assert_silent(&device);
    }
    println!("{scattering:?} macrocells do not scatter and do");
    assert!(scattering.iter().all(|&count| count > 50));
}

/// A batch of which the host believes that it gathers takes fewer reads of the volume than one that does not.
#[test]
fn host_and_shader_agree_on_when_nodes_gather() {
    // So wide that most cubes are not at the rim, whose paths do without the cache.
    const SIDE: u32 = 6 * BRICK;
    let camera = Camera {
        eye: [0.0, 0.0, 3.0],
        target: [0.0; 3],
        up: [0.0, 1.0, 0.0],
        projection: Projection::Orthographic { height: 1.0 },
    };
    let mut scene = empty_scene([8, 8], camera);
    scene.medium = Some(uniform_medium(40.0, 0.99, 0.0));
    scene.lights.environment.radiance = [1.0; 3];
    let volume = constant_field(1.0, [SIDE; 3], [1.0 / f64::from(SIDE); 3]);
    let mut cached = cached(&scene, &volume, 1.0, CacheFormat::F32, 0, 1);
    cached.caching().serve_all_views();
    for samples in [1, 1, 2, 4, 8, 15, 1, 1, GATHERED, 8] {
        let before = (
            cached.cache().work.paths,
            cached.cache().work.lookups,
            cached.updates(),
        );
        assert!(
            cached
                .caching()
                .batch(Batch::Paths(samples), Until::NEVER)
                .expect("a batch")
        );
        let paths = cached.cache().work.paths - before.0;
        let lookups_per_path = (cached.cache().work.lookups - before.1) as f64 / paths as f64;
        let gathers = batch_gathers(before.2, samples);
        println!(
            "{} + {samples}: {lookups_per_path:.1} reads a path, gathers {gathers}",
            before.2
        );
        // A gathered path has one collision and one shadow ray; a traced one has many.
        if before.2 > 0 {
            assert_eq!(gathers, lookups_per_path < 10.0, "after {} paths", before.2);
        }
    }
    assert_silent(&cached.device);
}
