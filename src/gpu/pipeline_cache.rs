//! The driver's own cache of pipelines, kept from one start to the next (`compiled.rs`).
//!
//! Drivers of desktops keep a cache by themselves; those of phones and MoltenVK do not. lavapipe and SwiftShader have
//! nothing to keep: their data are only a header.

use ash::vk;

use super::compiled::Compiled;

/// Bytes of the header with which every driver's data begin (`VkPipelineCacheHeaderVersionOne`).
const HEADER_BYTES: usize = 32;

pub(super) struct PipelineCache {
    /// Null if the driver has not made one: pipelines are then made without a cache.
    pub raw: vk::PipelineCache,
    compiled: Compiled,
    /// Name of the kept file, from driver and device.
    name: String,
    kept: Vec<u8>,
}

impl PipelineCache {
    /// The cache with the data kept for this driver and device, if there are any and they are valid.
    pub fn load(
        device: &ash::Device,
        properties: &vk::PhysicalDeviceProperties,
        compiled: Compiled,
    ) -> PipelineCache {
        let name = format!(
            "driver-{:x}-{:x}-{:x}-{:032x}",
            properties.vendor_id,
            properties.device_id,
            properties.driver_version,
            u128::from_be_bytes(properties.pipeline_cache_uuid),
        );
        let kept = compiled.load(&name);
        let kept = kept.filter(|data| is_for(properties, data));
        let kept = kept.unwrap_or_default();
        let info = vk::PipelineCacheCreateInfo::default().initial_data(&kept);
        // SAFETY: the data, if there are any, are what this version of this driver has returned for this device.
        let raw = unsafe { device.create_pipeline_cache(&info, None) };
        PipelineCache {
            raw: raw.unwrap_or_default(),
            compiled,
            name,
            kept,
        }
    }

    /// Keeps the data that the cache has by now, and destroys it.
    pub fn end(&self, device: &ash::Device) {
        if self.raw == vk::PipelineCache::null() {
            return;
        }
        // SAFETY: the cache is the device's, and no pipelines are made any more.
        let data = unsafe { device.get_pipeline_cache_data(self.raw) }.unwrap_or_default();
        if data.len() > HEADER_BYTES && data != self.kept {
            self.compiled.store(&self.name, &data);
        }
        // SAFETY: as above.
        unsafe { device.destroy_pipeline_cache(self.raw, None) };
    }
}

/// Whether the header names this device and driver. Drivers check that themselves, but not all of them check well.
fn is_for(properties: &vk::PhysicalDeviceProperties, data: &[u8]) -> bool {
    let words = [
        HEADER_BYTES as u32,
        vk::PipelineCacheHeaderVersion::ONE.as_raw() as u32,
        properties.vendor_id,
        properties.device_id,
    ];
    let header = [bytemuck::bytes_of(&words), &properties.pipeline_cache_uuid].concat();
    data.starts_with(&header)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn data_of_another_driver_or_device_are_not_given_to_this_one() {
        let properties = vk::PhysicalDeviceProperties {
            vendor_id: 0x10de,
            device_id: 0x2330,
            pipeline_cache_uuid: [7; 16],
            ..Default::default()
        };
        let header = |vendor: u32, device: u32, uuid: u8| {
            let words = [32u32, 1, vendor, device].map(u32::to_le_bytes);
            [&words.concat()[..], &[uuid; 16], b"code"].concat()
        };
        assert!(is_for(&properties, &header(0x10de, 0x2330, 7)));
        assert!(!is_for(&properties, &header(0x1002, 0x2330, 7)));
        assert!(!is_for(&properties, &header(0x10de, 0x2331, 7)));
        assert!(!is_for(&properties, &header(0x10de, 0x2330, 8)));
        assert!(!is_for(&properties, &header(0x10de, 0x2330, 7)[..31]));
    }
}
