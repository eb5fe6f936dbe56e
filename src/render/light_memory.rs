//! The GPU memory that a scene's lights take.

use std::sync::Arc;

use super::parts::Lights;
use super::shared::EnvironmentCell;
use crate::error::Result;
use crate::gpu::{Binding, Buffer, Format, Image, ImageDesc, Memory};

pub struct LightMemory {
    /// The buffers of [`Lights::lists`].
    lists: Vec<Buffer>,
    /// The sampling table of the sky's image.
    sky: Buffer,
    /// The sky's image, or a single texel that is black where the scene has none.
    pub environment: Image,
}

impl LightMemory {
    pub fn allocate(memory: &Arc<Memory>, lights: &Lights) -> Result<LightMemory> {
        let buffer = |(name, bytes): (_, Vec<u8>)| Buffer::with_data(memory, name, &bytes);
        let sky = lights.sky.as_deref();
        let table: &[EnvironmentCell] = sky.map_or(&[], |sky| &sky.table.sky);
        let [width, height] = sky.map_or([1, 1], |sky| sky.image.size());
        let environment = ImageDesc {
            name: "environment image",
            extent: [width, height, 1],
            volumetric: false,
            written: false,
            zeroed: true,
            format: Format::R32G32B32A32_SFLOAT,
        };
        Ok(LightMemory {
            lists: lights
                .lists()
                .into_iter()
                .map(buffer)
                .collect::<Result<_>>()?,
            sky: Buffer::with_data(memory, "environment table", table)?,
            environment: Image::new(memory, environment)?,
        })
    }

    /// Writes edited lights that have the same sky image.
    pub fn write(&mut self, lights: &Lights) -> Result<()> {
        let mut lists = self.lists.iter_mut().zip(lights.lists());
        lists.try_for_each(|(buffer, (_, bytes))| buffer.rewrite(&bytes))
    }

    /// The resources of every shader that includes `light.glsl`.
    pub fn bindings(&self) -> Vec<(&'static str, Binding<'_>)> {
        let lists = self
            .lists
            .iter()
            .map(|list| (list.desc.name, Binding::Buffer(list)));
        let sky = [
            ("sky", Binding::Buffer(&self.sky)),
            ("environment", Binding::Image(&self.environment)),
        ];
        lists.chain(sky).collect()
    }
}
