//! The picture as a display shows it: exposed, tone-mapped, encoded, and stretched to the size that is shown, since a
//! moving picture has fewer pixels.

use std::sync::Arc;

use crate::error::Result;
use crate::gpu::types::*;
use crate::gpu::{Binding, Device, Image, Pass, PassDesc, Recording, Shaders, Shared, Work};
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

    pub fn record<'r>(
        &'r self,
        recording: &mut Recording<'_, 'r>,
        picture: &'r Image,
        shown: &'r Image,
        push: &ToneMapPush,
    ) -> Result<()> {
        let bindings = [
            ("picture", Binding::Image(picture)),
            ("shown", Binding::Image(shown)),
        ];
        recording.dispatch(&self.0, &bindings, push, [push.size[0], push.size[1], 1])?;
        let [width, height] = push.source.map(u64::from);
        recording.state_work(Work::texels(width * height, 0));
        Ok(())
    }
}
