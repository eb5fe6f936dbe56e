//! The picture of the published baseline.

use std::sync::Arc;

use super::published_resources::PublishedResources;
use super::resources::Resources;
use super::shared::{Features, PublishedMarchPush};
use crate::error::Result;
use crate::gpu::{Binding, Device, Frame, Pass, PassDesc, Shaders, Specialization};

pub struct PublishedMarch(Pass);

impl PublishedMarch {
    pub fn new(device: &Arc<Device>, shaders: &Shaders, features: &Features) -> Result<Self> {
        let desc = PassDesc {
            name: "published_march",
            specialization: &features.words(),
            macros: &features.formats(),
        };
        Ok(PublishedMarch(Pass::new(device, shaders, &desc)?))
    }

    /// Leaves the picture in `mean`.
    pub fn run(
        &self,
        frame: &mut Frame,
        r: &Resources,
        cells: &PublishedResources,
        push: &PublishedMarchPush,
    ) -> Result<()> {
        let bindings = [
            ("scene_block", Binding::Buffer(&r.scene)),
            ("volume", r.volume_binding()),
            ("transfer", Binding::Image(&r.transfer)),
            ("clips", Binding::Buffer(&r.clips)),
            r.camera_binding(),
            ("ranges", Binding::Image(&r.ranges)),
            ("surfaces", Binding::Buffer(&r.surfaces)),
            ("suns", Binding::Buffer(&r.suns)),
            ("environment", Binding::Image(&r.environment)),
            ("sky", Binding::Buffer(&r.sky)),
            ("radiance_cells", Binding::Filtered(&cells.radiance)),
            ("mean", Binding::Image(&r.mean)),
        ];
        frame.run_in_slices(&self.0, &bindings, push, [r.size[0], r.size[1], 1])
    }
}
