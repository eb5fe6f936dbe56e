//! Compiles the passes of a scene: all of them for the same device, from the same shaders, with what the scene
//! needs and nothing else.

use std::sync::Arc;

use super::features::Features;
use super::gpu_scene::GpuScene;
use crate::error::Result;
use crate::gpu::{Device, Pass, PassDesc, Shaders, Shared, Specialization};

pub struct PassCompiler<'a> {
    device: &'a Arc<Device>,
    shaders: &'a Shaders,
    pub features: Features,
}

impl PassCompiler<'_> {
    pub fn new<'a>(
        device: &'a Arc<Device>,
        shaders: &'a Shaders,
        scene: &GpuScene,
    ) -> PassCompiler<'a> {
        PassCompiler {
            device,
            shaders,
            features: scene.features(),
        }
    }

    /// The pass whose shader is `glsl/NAME.comp`, and which takes a `P` as its push constants.
    pub fn compile<P: Shared>(&self, name: &'static str) -> Result<Pass> {
        let desc = PassDesc {
            name,
            specialization: &self.features.words(),
            push: P::PUSH,
            macros: &self.features.macros(),
        };
        Pass::new(self.device, self.shaders, &desc)
    }
}
