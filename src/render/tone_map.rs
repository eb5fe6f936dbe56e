//! What a display shows of a picture: exposed, tone-mapped, encoded, and stretched to the size that is
//! shown, since a moving picture has fewer pixels.

use std::sync::Arc;

use super::shared::ToneMapPush;
use crate::error::Result;
use crate::gpu::{Binding, Device, Frame, Image, Pass, PassDesc, Shaders};

pub struct ToneMap(Pass);

impl ToneMap {
    pub fn new(device: &Arc<Device>, shaders: &Shaders) -> Result<Self> {
        let desc = PassDesc {
            name: "tone_map",
            specialization: &[],
            macros: &[],
        };
        Ok(ToneMap(Pass::new(device, shaders, &desc)?))
    }

    pub fn record(
        &self,
        frame: &mut Frame,
        picture: &Image,
        shown: &Image,
        push: &ToneMapPush,
    ) -> Result<()> {
        let bindings = [
            ("picture", Binding::Image(picture)),
            ("shown", Binding::Image(shown)),
        ];
        frame.pass(&self.0, &bindings, push, [push.size[0], push.size[1], 1])
    }
}
