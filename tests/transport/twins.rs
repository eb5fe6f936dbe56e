//! Rules that stand in Rust and in GLSL, held against each other over their whole range.

use fastrand::Rng;
use glam::DVec3;
use isolume::gpu::*;
use isolume::output::display::display_value;
use isolume::render::shared::{BEND_DEPTH, BRICK, GATHERED, MACROCELL, RIM_DEPTH};
use isolume::render::{Batch, GpuScene, Renderer, ToneMapPush, Until, batch_gathers};
use isolume::scene::volume::Volume;
use isolume::scene::*;

use crate::passes::tone_map::tone_map_pass;
use crate::support::common::*;
use crate::support::fields::indexed_field;
use crate::support::probe::NOTHING;

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
    let pass = tone_map_pass(&device);
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
/// Least distance of points of the transfer function that are not one above the other.
const APART: f32 = 15.0;

/// Waves and noise. In half of the trials, all values are those of points of the transfer function, where rounding decides.
fn waves(trial: usize, random: &mut Rng) -> Volume {
    indexed_field([40, 33, 25], [1.0; 3], |[x, ..]| {
        let wave = (0.13 * f64::from(x) + 0.2 * trial as f64).sin();
        let above = (100.0 * wave + 4.0 * random.f64()) as f32 - BACKGROUND;
        let steps = above.max(0.0) / APART;
        BACKGROUND + APART * if trial % 2 == 1 { steps.round() } else { steps }
    })
}

fn transfer(trial: usize, random: &mut Rng) -> Vec<TransferPoint> {
    let background = f64::from(BACKGROUND);
    let points = match trial / 2 {
        // One ramp for all values, which begins at the background, and one that ends below the highest values.
        0 => vec![(background, 0.0), (149.0, 1.0)],
        1 => vec![(background, 1.0), (background + 150.0, 0.0)],
        _ => {
            let mut value = background - [45.0, 0.0][trial / 2 % 2];
            let point = |_| {
                // Some points share a value, which makes a step, and most of them are empty.
                value += [0.0, f64::from(APART), 60.0][random.usize(0..3)];
                (value, [0.0, 0.0, 0.0, 0.3, 1.0][random.usize(0..5)])
            };
            (0..6).map(point).collect()
        }
    };
    let point = |(value, opacity)| TransferPoint {
        value,
        opacity,
        color: [0.9; 3],
    };
    points.into_iter().map(point).collect()
}

/// The cache has memory where the CPU finds that a macrocell scatters, and paths collide where the GPU finds it.
#[test]
fn cpu_and_gpu_agree_on_where_the_medium_scatters() {
    let mut random = Rng::with_seed(3);
    let mut scattering = [0usize; 2];
    for trial in 0..36usize {
        let volume = waves(trial, &mut random);
        let camera = Camera {
            eye: [0.0, 0.0, 90.0],
            target: [0.0; 3],
            up: [0.0, 1.0, 0.0],
            projection: Projection::Perspective { fov_y: 30.0 },
        };
        let mut scene = empty_scene([8, 8], camera);
        scene.medium = Some(Medium::isotropic(0.7, transfer(trial, &mut random)));
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

/// A block of medium with sides of 1 under a white sky, and a cache that serves all views and is not filled yet. `side` is in
/// voxels.
fn lit_block(sigma_t: f64, albedo: f64, side: u32) -> Cached {
    let camera = Camera {
        eye: [0.0, 0.0, 3.0],
        target: [0.0; 3],
        up: [0.0, 1.0, 0.0],
        projection: Projection::Orthographic { height: 1.0 },
    };
    let mut scene = empty_scene([8, 8], camera);
    scene.medium = Some(uniform_medium(sigma_t, albedo, 0.0));
    scene.lights.environment.radiance = [1.0; 3];
    let volume = constant_field(1.0, [side; 3], [1.0 / f64::from(side); 3]);
    let mut cached = cached(&scene, &volume, 1.0, CacheFormat::F32, 0, 1);
    cached.caching().serve_all_views();
    cached
}

/// A batch of which the host believes that it gathers takes fewer reads of the volume than one that does not.
#[test]
fn host_and_shader_agree_on_when_nodes_gather() {
    // So wide that most cubes are not at the rim, whose paths do without the cache.
    const SIDE: u32 = 6 * BRICK;
    let mut cached = lit_block(40.0, 0.99, SIDE);
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

/// Whether the shader finds cubes of the cache at the rim of the medium.
fn marks_rims(scene: GpuScene, volume: &Volume) -> bool {
    let shaders = [
        "node_tracking",
        "cached_tracking",
        "tail_tracking",
        "camera_march",
        "ray_march",
    ]
    .into_iter()
    .fold(shaders(), |shaders, pass| {
        shaders.with_file(&format!("{pass}.comp"), NOTHING)
    });
    let cached = empty_cache(device(), &shaders, volume, scene);
    let rims = cached.cache().memory.rims.as_ref().expect("room for marks");
    let memory = Memory::new(&cached.device, 1 << 22).expect("memory");
    let mut frame = Frame::new(&cached.device).expect("a frame");
    let desc = BufferDesc::host_cached("marks", rims.desc().bytes);
    let marks = Buffer::new(&memory, desc).expect("a buffer");
    let run = frame.run(|recording| recording.copy(rims, &marks));
    run.expect("a copy");
    assert_silent(&cached.device);
    let words = marks.read_vec::<u32>(rims.desc().bytes as usize / 4);
    words.into_iter().any(|word| word != 0)
}

/// A medium a little less and a little more dense than it is where rims begin: at a face of the box, at a clip plane, and between
/// two voxels.
#[test]
fn host_and_shader_agree_on_when_a_medium_has_rims() {
    const DIMS: [u32; 3] = [48; 3];
    const SCALE: f64 = 0.5;
    let spacing = [1.0, 0.6, 0.8];
    let sides = DVec3::from(spacing) / SCALE;
    let across = ClipPlane {
        normal: sides.normalize().to_array(),
        offset: 0.0,
    };
    let camera = Camera {
        eye: [0.0, 0.0, 90.0],
        target: [0.0; 3],
        up: [0.0, 1.0, 0.0],
        projection: Projection::Orthographic { height: 50.0 },
    };
    let rim = f64::from(RIM_DEPTH);
    for (what, voxels, clips, least) in [
        ("a face", 0..48, vec![], rim / sides.max_element()),
        ("a plane", 16..32, vec![across], rim / sides.length()),
        ("a jump", 16..32, vec![], f64::from(BEND_DEPTH) / spacing[0]),
    ] {
        for has_rims in [false, true] {
            let extinction = least * if has_rims { 1.01 } else { 0.99 };
            let volume = indexed_field(DIMS, spacing, |voxel| {
                let is_inside = voxel.iter().all(|i| voxels.contains(i));
                if is_inside { extinction as f32 } else { 0.0 }
            });
            let scene = |largest_extinction: f64| {
                let mut scene = empty_scene([8, 8], camera);
                let points = [(0.0, 0.0), (largest_extinction, 1.0)];
                let transfer = points.map(|(value, opacity)| TransferPoint {
                    value,
                    opacity,
                    color: [0.9; 3],
                });
                scene.medium = Some(Medium::isotropic(largest_extinction, transfer.to_vec()));
                scene.clips = clips.clone();
                scene_with_cache(&scene, &volume, SCALE, CacheFormat::F32, 1)
            };
            let is_foreseen = scene(extinction).features().has_rim_cubes;
            assert_eq!(is_foreseen, has_rims, "{what}, the host");
            // No voxel is as dense as this transfer function allows, but the host lets the shader look.
            let mut looked_at = scene(1.0);
            let transfer = &mut looked_at.parts.medium.transfer;
            let mut densest = *transfer.last().expect("points");
            (densest.value, densest.opacity) = (1.0, 1.0);
            transfer.push(densest);
            let found = marks_rims(looked_at, &volume);
            assert_eq!(found, has_rims, "{what}, the shader");
        }
    }
}

/// The paths of a node come in parts, whose number the host picks and whose sizes the shader finds: together they are all of its
/// paths.
#[test]
fn host_and_shader_agree_on_the_paths_in_a_part() {
    let mut cached = lit_block(1.0, 0.9, 7);
    // From then on all nodes of a brick get the same number of paths.
    cached.fill(GATHERED);
    let nodes = cached.cache().memory.layout.active_nodes();
    // In the last batch, parts are larger than usual, since there would be too many.
    for paths in [1, 9, 17, 521] {
        let before = cached.cache().work.paths;
        let batch = cached.caching().batch(Batch::Paths(paths), Until::NEVER);
        assert!(batch.expect("a batch"));
        let traced = cached.cache().work.paths - before;
        assert_eq!(traced, nodes * u64::from(paths), "{paths} a node");
    }
    assert_silent(&cached.device);
}
