//! The GPU memory that a scene's lights take.

use std::sync::Arc;

use super::parts::Lights;
use super::shared::EnvironmentEntry;
use crate::error::Result;
use crate::gpu::{Binding, Buffer, Format, Image, ImageDesc, Memory};

/// The resource whose size is that of the user's image.
pub const ENVIRONMENT_IMAGE: &str = "environment image";

pub struct LightMemory {
    suns: Buffer,
    /// The sampling table of the sky's image.
    environment_table: Buffer,
    /// The sky's image, or a single texel that is black where the scene has none.
    pub environment: Image,
}

impl LightMemory {
    pub fn allocate(memory: &Arc<Memory>, lights: &Lights) -> Result<LightMemory> {
        let sky = lights.sky_image.as_deref();
        let table: &[EnvironmentEntry] = sky.map_or(&[], |sky| &sky.table.entries);
        let [width, height] = sky.map_or([1, 1], |sky| sky.image.size());
        let environment = ImageDesc::flat(
            ENVIRONMENT_IMAGE,
            [width, height],
            Format::R32G32B32A32_SFLOAT,
        )
        .zeroed();
        Ok(LightMemory {
            suns: Buffer::with_data(memory, "suns", &lights.suns)?,
            environment_table: Buffer::with_data(memory, "environment table", table)?,
            environment: Image::new(memory, environment)?,
        })
    }

    /// Writes edited lights that have the same sky image.
    pub fn write(&mut self, lights: &Lights) -> Result<()> {
        self.suns.rewrite(&lights.suns)
    }

    /// The resources of every shader that includes `light.glsl`.
    pub fn bindings(&self) -> [(&'static str, Binding<'_>); 3] {
        [
            ("suns", Binding::Buffer(&self.suns)),
            (
                "environment_table",
                Binding::Buffer(&self.environment_table),
            ),
            ("environment", Binding::Image(&self.environment)),
        ]
    }
}
