//! The picture as a display shows it: exposed, tone-mapped, encoded, and stretched to the size that is shown, since a
//! moving picture has fewer pixels.

use std::sync::Arc;

use crate::error::Result;
use crate::gpu::types::*;
use crate::gpu::{Binding, Device, Image, Pass, PassDesc, Recording, Shaders, Shared, Work};
use crate::render::parts::Display;
use crate::scene::Tone;
use crate::shared;

shared! {
    pub struct ToneMapPush {
        /// Pixels of the picture.
        pub source: uvec2,
        /// Pixels to show it in.
        pub size: uvec2,
        /// Factor by which radiance is multiplied.
        pub exposure: float,
        /// 0: clip; 1: the filmic curve.
        pub filmic: uint,
    }
}

pub struct ToneMap(Pass);

impl ToneMap {
    pub fn new(device: &Arc<Device>, shaders: &Shaders) -> Result<Self> {
        let desc = PassDesc {
            name: "tone_map",
            specialization: &[],
            push: ToneMapPush::PUSH,
            macros: &[],
        };
        Ok(ToneMap(Pass::new(device, shaders, &desc)?))
    }

    /// Encodes the first `source` pixels of a picture for all of `shown`.
    pub fn record<'r>(
        &'r self,
        recording: &mut Recording<'_, 'r>,
        picture: &'r Image,
        source: [u32; 2],
        shown: &'r Image,
        display: Display,
    ) -> Result<()> {
        let [width, height, _] = shown.desc().extent;
        let push = ToneMapPush {
            source,
            size: [width, height],
            exposure: display.exposure.exp2() as f32,
            filmic: (display.tone == Tone::Filmic) as u32,
        };
        let bindings = [
            ("picture", Binding::Image(picture)),
            ("shown", Binding::Image(shown)),
        ];
        recording.dispatch(&self.0, &bindings, &push, [width, height, 1])?;
        let pixels = source.map(u64::from).iter().product();
        recording.state_work(Work::texels(pixels, 0));
        Ok(())
    }
}
