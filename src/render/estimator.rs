//! A variant at work: its passes together with the GPU memory that only it takes, so that neither exists without the
//! other.

use std::sync::Arc;

use super::cache::{Cache, CacheMemory};
use super::delta_tracking::DeltaTracking;
use super::gpu_scene::GpuScene;
use super::pass_compiler::PassCompiler;
use super::picture::bundle::Bundle;
use super::published::{Published, PublishedCells};
use super::resources::Resources;
use super::variant::Variant;
use crate::error::{DeviceError, Result};
use crate::gpu::{Device, Format, Frame, Memory};

pub enum Estimator {
    NonCaching(Box<DeltaTracking>),
    Caching(Box<Cache>),
    Published(Box<Published>),
}

/// The GPU memory that only one variant takes.
pub enum VariantMemory {
    NonCaching,
    Caching(Box<CacheMemory>),
    Published(Box<PublishedCells>),
}

impl VariantMemory {
    pub fn allocate(memory: &Arc<Memory>, scene: &GpuScene) -> Result<VariantMemory> {
        Ok(match &scene.variant {
            Variant::NonCaching => VariantMemory::NonCaching,
            Variant::Caching(layout) => {
                VariantMemory::Caching(Box::new(CacheMemory::allocate(memory, layout, scene)?))
            }
            Variant::Published => {
                let dims = scene.parts.field.dims;
                VariantMemory::Published(Box::new(PublishedCells::allocate(memory, dims)?))
            }
        })
    }
}

impl Estimator {
    pub fn new(
        passes: &PassCompiler<'_>,
        device: &Device,
        scene: &GpuScene,
        memory: VariantMemory,
    ) -> Result<Estimator> {
        Ok(match memory {
            VariantMemory::NonCaching => {
                Estimator::NonCaching(Box::new(DeltaTracking::new(passes)?))
            }
            VariantMemory::Caching(memory) => {
                Estimator::Caching(Box::new(Cache::new(passes, scene, *memory)?))
            }
            VariantMemory::Published(cells) => {
                check_filter(device)?;
                Estimator::Published(Box::new(Published::new(passes, scene, *cells)?))
            }
        })
    }

    /// Fills memory that does not depend on the scene's parts.
    pub fn begin(&self, frame: &mut Frame, r: &mut Resources) -> Result<()> {
        match self {
            Estimator::Caching(cache) => cache.memory.begin(frame, &mut r.staging),
            Estimator::NonCaching(_) | Estimator::Published(_) => Ok(()),
        }
    }

    /// Runs each pass for a moment and forgets what it did.
    pub fn warm_up(&mut self, frame: &mut Frame, r: &Resources) -> Result<()> {
        match self {
            Estimator::NonCaching(tracking) => {
                tracking.advance(frame, r, &[], Bundle::TRIAL).map(drop)
            }
            Estimator::Caching(cache) => cache.warm_up(frame, r),
            Estimator::Published(published) => published.warm_up(frame, r),
        }
    }
}

/// The published method reads its cells through the device's filter.
fn check_filter(device: &Device) -> Result<()> {
    if device.filters(Format::R32G32B32A32_SFLOAT) {
        Ok(())
    } else {
        Err(DeviceError::Unable {
            device: device.summary.name.clone(),
            problem: "cannot filter images of 32-bit floats, which the variant \"published\" needs; use another variant".into(),
        }
        .into())
    }
}
