//! The passes of every variant; those that fill a cache and take samples belong to an estimator.

use std::sync::Arc;

use super::majorants::Majorants;
use super::pass_compiler::PassCompiler;
use super::patches::Patches;
use super::picture::accumulate::Accumulate;
use super::picture::iso_depth::{FirstSurface, IsoDepth};
use super::picture::tone_map::ToneMap;
use crate::error::Result;
use crate::gpu::{Device, Shaders};

pub struct Passes {
    pub majorants: Majorants,
    pub patches: Patches,
    pub accumulate: Accumulate,
    pub tone_map: ToneMap,
    /// `None` in a scene without surfaces.
    pub iso_depth: Option<IsoDepth>,
}

impl Passes {
    /// `first_surface`: the images of the first surface's layers, in a scene that has surfaces.
    pub fn compile(
        compiler: &PassCompiler<'_>,
        device: &Arc<Device>,
        shaders: &Shaders,
        first_surface: Option<FirstSurface>,
    ) -> Result<Passes> {
        let iso_depth = first_surface.map(|images| IsoDepth::new(compiler, images));
        Ok(Passes {
            majorants: Majorants::new(compiler)?,
            patches: Patches::new(compiler)?,
            accumulate: Accumulate::new(compiler)?,
            tone_map: ToneMap::new(device, shaders)?,
            iso_depth: iso_depth.transpose()?,
        })
    }
}
