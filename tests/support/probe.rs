//! A scene on the GPU, and small passes of a test's own that run on it: the shaders' functions are
//! tested where they run, one thread an input.

use std::collections::HashMap;
use std::sync::Arc;

use isolume::gpu::*;
use isolume::render::features::Features;
use isolume::render::shared::{self, SceneConstants};
use isolume::render::{GpuScene, Renderer, Resources};
use isolume::scene::Scene;
use isolume::scene::volume::Volume;

use crate::support::common::{BUDGET, assert_silent, device};

pub struct Probe {
    device: Arc<Device>,
    pub memory: Arc<Memory>,
    pub renderer: Renderer,
    /// What the passes are compiled for.
    pub features: Features,
    pub constants: SceneConstants,
    /// By name, text and what they are compiled for.
    passes: HashMap<String, Pass>,
}

/// A pass in `tests/support/glsl/`. It reads `inputs`, writes `outputs`, and takes `push`.
pub struct Shader {
    pub name: &'static str,
    pub text: &'static str,
    /// The scene's resources that it uses, by name; "lights" are those of `light.glsl`.
    pub uses: &'static [&'static str],
}

pub const NOTHING: &str = "#version 460\nlayout(local_size_x = 1) in; void main() {}";

impl Probe {
    pub fn new(scene: &Scene, volume: &Volume) -> Probe {
        let device = device();
        let memory = Memory::new(&device, BUDGET).expect("memory");
        let scene = GpuScene::new(scene, volume, 1);
        let (features, constants) = (scene.features(), scene.constants());
        // No path is traced here, and the large shader that would do it takes seconds to compile.
        let shaders = Shaders::new(shared::glsl()).with_file("delta_tracking.comp", NOTHING);
        let renderer = Renderer::with_shaders(&memory, &shaders, volume, scene);
        let renderer = renderer.expect("a renderer");
        Probe {
            device,
            memory,
            renderer,
            features,
            constants,
            passes: HashMap::new(),
        }
    }

    /// One thread for each of `threads`; the outputs, however many the shader writes.
    pub fn run<P: Shared, I: Shared, O: Shared>(
        &mut self,
        shader: &Shader,
        push: &P,
        inputs: &[I],
        threads: usize,
        outputs: usize,
    ) -> Vec<O> {
        let shared = [&shared::glsl(), I::GLSL, O::GLSL].concat();
        let desc = PassDesc {
            name: shader.name,
            specialization: &self.features.words(),
            push: P::PUSH,
            macros: &self.features.macros(),
        };
        let what = (desc.name, shader.text, desc.specialization, desc.macros);
        let compile = || {
            let shaders = Shaders::new(shared);
            let shaders = shaders.with_file(&format!("{}.comp", shader.name), shader.text);
            Pass::new(&self.device, &shaders, &desc).expect("a pass")
        };
        let pass = &*self
            .passes
            .entry(format!("{what:?}"))
            .or_insert_with(compile);
        let inputs = Buffer::with_data(&self.memory, "inputs", inputs).expect("inputs");
        let desc = BufferDesc::host_cached("outputs", (outputs * size_of::<O>()) as u64);
        let results = Buffer::new(&self.memory, desc).expect("outputs");
        let (frame, r) = self.renderer.probed();
        r.scene.write(&[self.constants]);
        let mut bindings: Vec<(&str, Binding<'_>)> =
            shader.uses.iter().flat_map(|n| bindings(r, n)).collect();
        bindings.push(("inputs", Binding::Buffer(&inputs)));
        bindings.push(("outputs", Binding::Buffer(&results)));
        frame
            .run(|recording| recording.dispatch(pass, &bindings, push, [threads as u32, 1, 1]))
            .expect("a run");
        assert_silent(&self.device);
        results.read_vec(outputs)
    }
}

fn bindings<'a>(r: &'a Resources, name: &'static str) -> Vec<(&'static str, Binding<'a>)> {
    let binding = match name {
        "lights" => return r.lights.bindings().to_vec(),
        "scene_block" => Binding::Buffer(&r.scene),
        "volume" => Binding::Image(&r.volumes[0]),
        "ranges" => Binding::Image(&r.ranges),
        "transfer" => Binding::Image(&r.transfer),
        "clips" => Binding::Buffer(&r.clips),
        "surfaces" => Binding::Buffer(&r.surfaces),
        _ => panic!("no resource is called {name}"),
    };
    vec![(name, binding)]
}
