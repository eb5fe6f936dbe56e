//! Renders in process, with core and synchronization validation on: any message is a failure.

use std::sync::Arc;

use isolume::engine::{Host, HostOptions};
use isolume::gpu::{Device, DeviceChoice, Memory, Shaders, Validation};
use isolume::render::{
    Batch, Cache, CacheLayout, Caching, Film, FirstHits, GpuScene, Renderer, Until,
    next_batch_size, shared,
};
use isolume::scene::volume::{Volume, Voxels};
use isolume::scene::*;

pub const BUDGET: u64 = 1 << 30;

/// A device under validation. `ISOLUME_TEST_FETCHES=1` has it read images as a GPU does, whatever it is: `tools/devices` runs
/// the tests both ways.
pub fn device() -> Arc<Device> {
    device_that_fetches(std::env::var_os("ISOLUME_TEST_FETCHES").is_some_and(|v| v == "1"))
}

/// The same; true: it reads images as a GPU does, whatever it is.
pub fn device_that_fetches(fetches_texels: bool) -> Arc<Device> {
    let choice = DeviceChoice {
        validation: Validation::On,
        fetches_texels,
        ..DeviceChoice::default()
    };
    Device::open(&choice).expect("a Vulkan device and the validation layers")
}

/// The same for a program that drives an engine.
pub fn watched_host() -> Host {
    let options = HostOptions {
        validation: true,
        ..HostOptions::default()
    };
    Host::open(&options).expect("a Vulkan device and the validation layers")
}

pub fn assert_silent(device: &Device) {
    let messages = device.validation_messages();
    assert!(messages.is_empty(), "validation says: {messages:#?}");
}

/// `units` units of `samples` samples each.
pub fn render(scene: &Scene, volume: &Volume, units: u32, samples: u32, seed: u32) -> Film {
    render_with_shaders(&shaders(), scene, volume, units, samples, seed)
}

/// The same by shaders in which a test may have changed the text.
pub fn render_with_shaders(
    shaders: &Shaders,
    scene: &Scene,
    volume: &Volume,
    units: u32,
    samples: u32,
    seed: u32,
) -> Film {
    let device = device();
    let memory = Memory::new(&device, BUDGET).expect("memory");
    let scene = GpuScene::new(scene, volume, seed);
    let mut renderer = Renderer::with_shaders(&memory, shaders, volume, scene).expect("a renderer");
    for _ in 0..units {
        assert!(renderer.unit(samples, Until::NEVER).expect("a unit"));
    }
    let film = renderer.film().expect("a film");
    assert_silent(&device);
    film
}

/// Pictures of one unit of `samples` samples, one for each seed. Passes are compiled once.
pub fn render_seeds(
    scene: &Scene,
    volume: &Volume,
    samples: u32,
    seeds: impl IntoIterator<Item = u32>,
) -> Vec<Film> {
    let device = device();
    let memory = Memory::new(&device, BUDGET).expect("memory");
    let scene = GpuScene::new(scene, volume, 0);
    let mut renderer = Renderer::new(&memory, volume, scene).expect("a renderer");
    let film = |seed| {
        reseed(&mut renderer, seed);
        assert!(renderer.unit(samples, Until::NEVER).expect("a unit"));
        renderer.film().expect("a film")
    };
    let films = seeds.into_iter().map(film).collect();
    assert_silent(&device);
    films
}

/// Begins the picture anew with other random numbers, without compiling anything.
fn reseed(renderer: &mut Renderer, seed: u32) {
    let mut scene = renderer.scene().clone();
    scene.parts.seed = seed;
    renderer.change(&scene).expect("the same scene");
}

pub fn shaders() -> Shaders {
    Shaders::new(shared::glsl())
}

/// The shaders with `wrong` in the place of `right`, which is in `text` of the file at `path`.
pub fn shaders_with(path: &str, text: &str, right: &str, wrong: &str) -> Shaders {
    assert!(text.contains(right), "{path} has no `{right}`");
    shaders().with_file(path, &text.replace(right, wrong))
}

/// What the pixels' centres see of surfaces.
pub fn first_hits(scene: &Scene, volume: &Volume) -> FirstHits {
    let device = device();
    let memory = Memory::new(&device, BUDGET).expect("memory");
    let scene = GpuScene::new(scene, volume, 0);
    let mut renderer = Renderer::new(&memory, volume, scene).expect("a renderer");
    let hits = renderer.first_hits().expect("first hits");
    assert_silent(&device);
    hits
}

pub fn mean_red(pixels: &[[f32; 4]]) -> f64 {
    pixels.iter().map(|p| f64::from(p[0])).sum::<f64>() / pixels.len() as f64
}

/// Of red, relative to its mean in `b`.
pub fn rms_difference(a: &[[f32; 4]], b: &[[f32; 4]]) -> f64 {
    let pairs = || a.iter().zip(b).map(|(a, b)| [a[0], b[0]].map(f64::from));
    let squares: f64 = pairs().map(|[a, b]| (a - b).powi(2)).sum();
    (squares / b.len() as f64).sqrt() / mean_red(b)
}

/// A field that is the same everywhere.
pub fn constant_field(value: f32, dims: [u32; 3], spacing: [f64; 3]) -> Volume {
    let count = dims.iter().product::<u32>() as usize;
    Volume::from_values(dims, spacing, Voxels::F32(vec![value; count])).expect("a volume")
}

/// Vacuum under a black sky, seen from +z; tests fill in what they are about.
pub fn empty_scene(size: [u32; 2], camera: Camera) -> Scene {
    Scene {
        medium: None,
        surfaces: Surfaces {
            light: LightModel::Local,
            normals: Normals::Smooth,
            iso: Vec::new(),
        },
        lights: Lights::default(),
        clips: Vec::new(),
        camera,
        render: RenderSettings {
            size,
            max_bounces: 0,
            variant: Variant::NonCaching,
            cache_scale: CacheScale::Auto,
            cache_format: CacheFormat::Auto,
            background: Background::Environment,
            exposure: 0.0,
            tone: Tone::Linear,
        },
    }
}

/// σt = density wherever the field is positive, of one albedo.
pub fn uniform_medium(density: f64, albedo: f64, g: f64) -> Medium {
    let point = |value: f64| TransferPoint {
        value,
        opacity: 1.0,
        color: [albedo; 3],
    };
    Medium {
        g,
        ..Medium::isotropic(density, vec![point(0.0)])
    }
}

/// A renderer with a cache.
pub struct Cached {
    pub device: Arc<Device>,
    pub renderer: Renderer,
}

/// With a cache that holds `updates` paths a node in sight (a power of two).
pub fn cached(
    scene: &Scene,
    volume: &Volume,
    scale: f64,
    format: CacheFormat,
    updates: u32,
    seed: u32,
) -> Cached {
    let scene = scene_with_cache(scene, volume, scale, format, seed);
    let mut cached = empty_cache(device(), &shaders(), volume, scene);
    cached.fill(updates);
    cached
}

/// A scene in the variant with a cache.
pub fn scene_with_cache(
    scene: &Scene,
    volume: &Volume,
    scale: f64,
    format: CacheFormat,
    seed: u32,
) -> GpuScene {
    let scene = GpuScene::new(scene, volume, seed);
    let occupancy = scene.occupancy(volume);
    let layout = CacheLayout::new(volume.dims, &occupancy, scale, format, 4096);
    scene.with_cache(layout.expect("a layout"))
}

/// The cache of a scene in the variant with one.
pub fn empty_cache(
    device: Arc<Device>,
    shaders: &Shaders,
    volume: &Volume,
    scene: GpuScene,
) -> Cached {
    let memory = Memory::new(&device, BUDGET).expect("memory");
    let renderer = Renderer::with_shaders(&memory, shaders, volume, scene);
    Cached {
        device,
        renderer: renderer.expect("a renderer"),
    }
}

impl Cached {
    /// Begins cache and picture anew with other random numbers.
    pub fn reseed(&mut self, seed: u32) {
        reseed(&mut self.renderer, seed);
        self.caching().clear();
    }

    /// The same with another scene, which the same passes serve.
    pub fn change(&mut self, scene: &Scene, volume: &Volume) {
        let changed = self.renderer.scene().changed_to(scene, volume);
        assert!(self.renderer.scene().passes_serve(&changed));
        self.renderer.change(&changed).expect("a change");
        self.caching().clear();
    }

    pub fn cache(&self) -> &Cache {
        self.renderer.cache().expect("a cache")
    }

    pub fn caching(&mut self) -> Caching<'_> {
        self.renderer.caching().expect("a cache")
    }

    pub fn updates(&self) -> u32 {
        self.cache().filling.updates
    }

    pub fn fill(&mut self, updates: u32) {
        while self.updates() < updates {
            let batch = next_batch_size(self.updates());
            assert!(
                self.caching()
                    .batch(Batch::Paths(batch), Until::NEVER)
                    .expect("a batch")
            );
        }
    }

    /// The picture at rest, after `units` units of `samples` samples each.
    pub fn at_rest(&mut self, units: u32, samples: u32) -> Film {
        for _ in 0..units {
            assert!(self.renderer.unit(samples, Until::NEVER).expect("a unit"));
        }
        let film = self.renderer.film().expect("a film");
        assert_silent(&self.device);
        film
    }

    /// The picture for a moving camera.
    pub fn march(&mut self) -> Vec<[f32; 4]> {
        let picture = self.caching().march().expect("a picture");
        assert_silent(&self.device);
        picture
    }
}
