//! A scene on the GPU: everything is allocated and loaded once, and changed with the scene. `frame.rs` says what runs on it in
//! a frame, and `picture/units.rs` how frames make samples.

use std::sync::Arc;
use std::time::Duration;

use super::allocation::Allocation;
use super::bricks::{BrickFigures, VolumeBricks};
use super::cache::{Cache, Caching};
use super::estimator::Estimator;
use super::gpu_scene::GpuScene;
use super::parts::{Changes, Part};
use super::pass_compiler::PassCompiler;
use super::passes::Passes;
use super::picture::accumulate::AccumulatePush;
use super::picture::halves::Halves;
use super::picture::totals::Totals;
use super::picture::under_way::UnderWay;
use super::published::PublishedCells;
use super::resources::Resources;
use super::shared;
use super::upload;
use super::variant::Variant;
use crate::error::Result;
use crate::gpu::{Frame, Memory, Shaders, Timings};
use crate::scene::volume::Volume;

pub struct Renderer {
    pub(super) frame: Frame,
    /// The scene as the GPU has it.
    pub(super) scene: GpuScene,
    pub(super) resources: Resources,
    pub(super) estimator: Estimator,
    pub(super) passes: Passes,
    pub(super) totals: Totals,
    /// The picture at the last power of two of marched samples, and what it says of their variance; `None` where samples are
    /// paths, or too few.
    pub(super) halves: Option<Arc<Halves>>,
    pub(super) under_way: UnderWay,
    /// Whether `mean` and `squares` hold an earlier picture, and have to be cleared before anything is added.
    pub(super) is_stale: bool,
    compiling: Duration,
}

impl Renderer {
    /// Allocates the resources, uploads the scene and compiles all passes.
    ///
    /// # Errors
    ///
    /// If memory is refused, a shader does not compile, the volume cannot be read, or the device fails.
    pub fn new(memory: &Arc<Memory>, volume: &Volume, scene: GpuScene) -> Result<Renderer> {
        let shaders = Shaders::new(shared::glsl());
        Renderer::with_shaders(memory, &shaders, volume, scene)
    }

    /// A renderer whose passes `shaders` compiles: a test may have replaced the text of a file.
    pub fn with_shaders(
        memory: &Arc<Memory>,
        shaders: &Shaders,
        volume: &Volume,
        scene: GpuScene,
    ) -> Result<Renderer> {
        let device = memory.device();
        let Allocation {
            mut resources,
            first_surface,
            variant,
        } = Allocation::make(memory, &scene)?;
        let mut frame = Frame::new(device)?;
        let compiler = PassCompiler::new(device, shaders, &scene);
        // Compiling is most of a start: all cores share it, and the voxels are on their way to the GPU meanwhile.
        let (estimator, passes) = rayon::join(
            || Estimator::new(&compiler, device, &scene, variant),
            || {
                if let Some(bricks) = &mut resources.bricks {
                    bricks.compile(&compiler)?;
                }
                upload::load(&mut frame, &mut resources, volume, &scene)?;
                Passes::compile(&compiler, device, shaders, first_surface)
            },
        );
        let (estimator, passes) = (estimator?, passes?);
        estimator.begin(&mut frame, &mut resources)?;
        let mut renderer = Renderer {
            frame,
            resources,
            estimator,
            passes,
            totals: Totals::default(),
            halves: None,
            under_way: UnderWay::Nothing,
            is_stale: false,
            compiling: Duration::ZERO,
            scene,
        };
        renderer.prepare(Changes::ALL)?;
        renderer.compiling = shaders.time_spent();
        Ok(renderer)
    }

    /// Time that compiling all passes took.
    pub fn compiling(&self) -> Duration {
        self.compiling
    }

    /// Times of the GPU's passes, one after another.
    pub fn timings(&self) -> &Timings {
        &self.frame.timings
    }

    pub fn timings_mut(&mut self) -> &mut Timings {
        &mut self.frame.timings
    }

    pub fn totals(&self) -> Totals {
        self.totals
    }

    /// Size of the picture in pixels.
    pub fn size(&self) -> [u32; 2] {
        self.resources.size
    }

    /// The scene as the GPU has it.
    pub fn scene(&self) -> &GpuScene {
        &self.scene
    }

    /// The cache, in the variant that has one.
    pub fn cache(&self) -> Option<&Cache> {
        match &self.estimator {
            Estimator::Caching(cache) => Some(cache),
            Estimator::NonCaching(_) | Estimator::Published(_) => None,
        }
    }

    /// The cells of the published baseline, if that is the variant.
    pub fn published_cells(&self) -> Option<&PublishedCells> {
        match &self.estimator {
            Estimator::Published(published) => Some(&published.cells),
            Estimator::NonCaching(_) | Estimator::Caching(_) => None,
        }
    }

    /// Figures of the streaming so far; `None` where the volume is whole.
    pub fn brick_figures(&self) -> Option<BrickFigures> {
        self.resources.bricks.as_ref().map(VolumeBricks::figures)
    }

    /// The operations on the cache, in the variant that has one.
    pub fn caching(&mut self) -> Option<Caching<'_>> {
        match &mut self.estimator {
            Estimator::Caching(cache) => Some(Caching {
                cache,
                frame: &mut self.frame,
                r: &mut self.resources,
                tone_map: &self.passes.tone_map,
                under_way: &mut self.under_way,
            }),
            Estimator::NonCaching(_) | Estimator::Published(_) => None,
        }
    }

    /// The frame on which a test's own pass records, and the resources that it reads.
    #[doc(hidden)]
    pub fn probed(&mut self) -> (&mut Frame, &mut Resources) {
        (&mut self.frame, &mut self.resources)
    }

    /// Continues with another scene that the same passes serve (`GpuScene::passes_serve`), of the same volume and
    /// variant, and with a picture that the images have room for. Returns whether the cache's light is still right;
    /// if not, it is gone.
    pub fn change(&mut self, next: &GpuScene) -> Result<bool> {
        let changes = next.changes_from(&self.scene);
        let lasts = self.scene.shares_light_with(next);
        self.resources.write(next)?;
        if changes.has(Part::Medium) {
            upload::upload_transfer(&mut self.frame, &mut self.resources, next)?;
        }
        if let (Estimator::Caching(cache), Variant::Caching(layout)) =
            (&mut self.estimator, &next.variant)
            && cache.memory.layout != *layout
        {
            cache.lay_out(&mut self.frame, &mut self.resources, layout)?;
        }
        self.scene = next.clone();
        self.prepare(changes)?;
        Ok(lasts)
    }

    /// Runs each pass for a moment and forgets the results: some drivers finish compiling only then, and measurements
    /// should not include that.
    pub fn warm_up(&mut self) -> Result<()> {
        let (frame, r) = (&mut self.frame, &self.resources);
        self.estimator.warm_up(frame, r)?;
        let push = AccumulatePush {
            samples: 1,
            samples_before: 0,
            first: 0,
            end: r.size[0] * r.size[1],
        };
        frame.run(|recording| self.passes.accumulate.record(recording, r, 1, &push))?;
        self.begin_picture();
        Ok(())
    }

    /// Makes room for pictures of another size; `change` then sets the size.
    pub fn resize(&mut self, size: [u32; 2]) -> Result<()> {
        self.resources.resize(size)?;
        if let Some(iso_depth) = &mut self.passes.iso_depth {
            iso_depth.resize(size)?;
        }
        if let Estimator::Caching(cache) = &mut self.estimator {
            cache
                .memory
                .resize_for_picture(size, self.resources.slots())?;
            cache.abandon();
        }
        self.begin_picture();
        Ok(())
    }

    /// Sets the index that the first sample of this picture has in the whole picture.
    pub fn begin_at_sample(&mut self, first: u32) {
        self.totals.first_sample = first;
        self.begin_picture();
    }

    /// Begins the picture anew; the cache stays.
    pub fn begin_picture(&mut self) {
        self.totals.samples = 0;
        self.totals.units = 0;
        self.totals.seen_since = None;
        self.totals.paths_before = self.totals.paths;
        self.totals.lookups_before = self.totals.lookups;
        self.under_way = UnderWay::Nothing;
        self.halves = None;
        self.is_stale = true;
    }

    /// Sets the time that a slice of work may take from now on, in milliseconds, while a window waits for its next frame.
    pub fn set_slice_ms(&mut self, ms: f64) {
        self.frame.slice_ms = ms;
        if let Some(bricks) = &self.resources.bricks {
            bricks.set_slice_ms(ms);
        }
    }

    /// Whether a picture at rest is marched.
    pub fn is_marched(&self) -> bool {
        self.cache().is_some_and(Cache::is_marched)
    }

    /// Paths traced, for the cache and for the picture.
    pub fn paths(&self) -> u64 {
        self.totals.paths + self.cache().map_or(0, |cache| cache.work.paths)
    }

    /// Reads of the volume by these paths.
    pub fn lookups(&self) -> u64 {
        self.totals.lookups + self.cache().map_or(0, |cache| cache.work.lookups)
    }
}
