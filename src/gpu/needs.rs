//! The requirements that Isolume has of a device: one table, each row with its reason. A row without a fallback is
//! mandatory, and a device that does not meet it cannot be used. `survey.rs` reads the table to choose a device, and
//! `isolume info` and `isolume doctor` print it.

use ash::{ext, vk};

use super::instance::{Instance, queue_families};

/// The most threads of a workgroup, storage buffers, storage images and sampled images that a shader may have. Vulkan
/// promises 128, 4, 4 and 16; SwiftShader, the narrowest driver that Isolume has run on, grants 256, 16, 16 and 16.
/// `Pass::new` enforces these limits on the shaders, so that the table always covers them.
pub(super) const GROUP_THREADS: u32 = 64;
pub(super) const STORAGE_BUFFERS: u32 = 16;
pub(super) const STORAGE_IMAGES: u32 = 8;
pub(super) const SAMPLED_IMAGES: u32 = 16;
/// The most storage images of a shader where all images are read as storage images (`glsl/include/texels.glsl`); a row of
/// the table names this number.
pub(super) const LOADED_IMAGES: u32 = 16;

/// How many more images than the table asks for a shader may read, with or without the storage images that a CPU reads.
pub(super) fn extra_images(limits: &vk::PhysicalDeviceLimits, is_software: bool) -> u32 {
    let sampled = limits
        .max_per_stage_descriptor_sampled_images
        .min(limits.max_per_stage_descriptor_samplers)
        .saturating_sub(SAMPLED_IMAGES);
    let stored = limits.max_per_stage_descriptor_storage_images;
    if is_software {
        sampled.min(stored.saturating_sub(LOADED_IMAGES))
    } else {
        sampled
    }
}

/// A row of the table, with what one device offers.
#[derive(Debug, Clone, PartialEq, Eq, serde::Serialize)]
pub struct Need {
    /// Vulkan's name for the feature or limit.
    pub name: &'static str,
    pub needed: String,
    pub found: String,
    pub holds: bool,
    /// What Isolume uses it for.
    pub reason: &'static str,
    /// What happens without it; `None`: the device cannot be used.
    pub fallback: Option<&'static str>,
}

impl Need {
    /// A description of what the device lacks, if it cannot be used without this.
    pub(super) fn shortcoming(&self) -> Option<String> {
        let Need {
            name,
            needed,
            found,
            reason,
            ..
        } = self;
        match (self.holds || self.fallback.is_some(), found.as_str()) {
            (true, _) => None,
            (false, "absent") => Some(format!("{name} (for {reason})")),
            (false, found) => Some(format!("{name} {needed} (for {reason}; it has {found})")),
        }
    }

    fn or(mut self, fallback: &'static str) -> Need {
        self.fallback = Some(fallback);
        self
    }
}

fn presence(name: &'static str, present: bool, reason: &'static str) -> Need {
    Need {
        name,
        needed: "present".into(),
        found: if present { "present" } else { "absent" }.into(),
        holds: present,
        reason,
        fallback: None,
    }
}

fn at_least(name: &'static str, needed: u32, found: u32, reason: &'static str) -> Need {
    Need {
        name,
        needed: needed.to_string(),
        found: found.to_string(),
        holds: found >= needed,
        reason,
        fallback: None,
    }
}

const SAMPLED: vk::FormatFeatureFlags = vk::FormatFeatureFlags::SAMPLED_IMAGE;
const STORED: vk::FormatFeatureFlags = vk::FormatFeatureFlags::STORAGE_IMAGE;
const FILTERED: vk::FormatFeatureFlags = vk::FormatFeatureFlags::SAMPLED_IMAGE_FILTER_LINEAR;

/// Formats of images, and whether shaders write them.
const FORMATS: [(&str, vk::Format, bool, &str); 8] = [
    ("R8_UNORM", vk::Format::R8_UNORM, false, "voxels of 8 bits"),
    (
        "R16_UNORM",
        vk::Format::R16_UNORM,
        false,
        "voxels of 16 bits",
    ),
    (
        "R32_SFLOAT",
        vk::Format::R32_SFLOAT,
        true,
        "other voxels, and majorants",
    ),
    (
        "R32_UINT",
        vk::Format::R32_UINT,
        true,
        "patches, and the cache's page table",
    ),
    (
        "R32G32_SFLOAT",
        vk::Format::R32G32_SFLOAT,
        true,
        "ranges of macrocells, and paths of the published variant",
    ),
    (
        "R16G16B16A16_SFLOAT",
        vk::Format::R16G16B16A16_SFLOAT,
        true,
        "a cache in 16 bits",
    ),
    (
        "R32G32B32A32_SFLOAT",
        vk::Format::R32G32B32A32_SFLOAT,
        true,
        "the picture, and a cache in 32 bits",
    ),
    (
        "R8G8B8A8_UNORM",
        vk::Format::R8G8B8A8_UNORM,
        true,
        "the picture as a display shows it",
    ),
];

/// The table for one device.
pub(super) fn needs(instance: &Instance, physical: vk::PhysicalDevice) -> Vec<Need> {
    // SAFETY: `physical` belongs to the live instance.
    let properties = unsafe { instance.raw.get_physical_device_properties(physical) };
    let api = properties.api_version;
    let version = Need {
        name: "Vulkan",
        needed: "1.3".into(),
        found: format!(
            "{}.{}",
            vk::api_version_major(api),
            vk::api_version_minor(api)
        ),
        holds: api >= vk::API_VERSION_1_3,
        reason: "barriers by stage, the size of an image before it is made, and drawing without render passes",
        fallback: None,
    };
    if !version.holds {
        return vec![version];
    }
    let mut table = vec![version];
    table.extend(required(instance, physical));
    table.extend(optional(instance, physical, &properties));
    table.extend(limits(&properties.limits));
    table.extend(formats(instance, physical));
    table
}

/// What no pass can do without.
fn required(instance: &Instance, physical: vk::PhysicalDevice) -> [Need; 3] {
    let mut twelve = vk::PhysicalDeviceVulkan12Features::default();
    let mut all = vk::PhysicalDeviceFeatures2::default().push_next(&mut twelve);
    // SAFETY: `physical` belongs to the live instance, and the chain outlives the call.
    unsafe {
        instance
            .raw
            .get_physical_device_features2(physical, &mut all)
    };
    let stores_more = all.features.shader_storage_image_extended_formats == vk::TRUE;
    let families = queue_families(instance, physical);
    [
        presence("compute queue", families.iter().any(computes), "every pass"),
        presence(
            "scalarBlockLayout",
            twelve.scalar_block_layout == vk::TRUE,
            "structs that shaders and Rust share byte by byte",
        ),
        presence(
            "shaderStorageImageExtendedFormats",
            stores_more,
            "storage images of two floats, and of 8 and 16 bits where a CPU reads voxels",
        ),
    ]
}

/// What has a fallback.
fn optional(
    instance: &Instance,
    physical: vk::PhysicalDevice,
    properties: &vk::PhysicalDeviceProperties,
) -> [Need; 6] {
    let families = queue_families(instance, physical);
    let mut computing = families.iter().filter(|family| computes(family));
    let is_cpu = properties.device_type == vk::PhysicalDeviceType::CPU;
    [
        presence(
            "timestamps",
            computing.any(has_timestamps),
            "the time of each pass",
        )
        .or("passes are timed by the host's clock, a submission at a time"),
        presence(
            "VK_EXT_memory_budget",
            instance.has_extension(physical, ext::memory_budget::NAME),
            "knowing how much memory is left",
        )
        .or("the budget is 80 % of the device's heap"),
        presence(
            "votes of a subgroup",
            can_vote(instance, physical),
            "ending the work of a subgroup's threads at the same time",
        )
        .or("a thread that has done its work waits for its neighbours"),
        presence(
            "storage images of every format",
            can_store_texels(instance, physical),
            "writing bricks of a volume into their image by a pass, which a GPU does",
        )
        .or("a GPU writes bricks by copies, which takes longer"),
        presence(
            "16 storage images in a pass",
            can_load_texels(instance, physical),
            "a CPU, which reads texels faster without its sampler",
        )
        .or("a CPU fetches texels through its sampler"),
        presence(
            "17 images in a pass",
            extra_images(&properties.limits, is_cpu) > 0,
            "a volume in bricks that takes several allocations",
        )
        .or("all bricks of a volume are in one allocation"),
    ]
}

fn computes(family: &vk::QueueFamilyProperties) -> bool {
    family.queue_flags.contains(vk::QueueFlags::COMPUTE)
}

/// Whether the threads of a compute shader that run together can vote.
pub(super) fn can_vote(instance: &Instance, physical: vk::PhysicalDevice) -> bool {
    let mut eleven = vk::PhysicalDeviceVulkan11Properties::default();
    let mut all = vk::PhysicalDeviceProperties2::default().push_next(&mut eleven);
    // SAFETY: `physical` belongs to the live instance, and the chain outlives the call.
    unsafe {
        instance
            .raw
            .get_physical_device_properties2(physical, &mut all)
    };
    let operations = eleven.subgroup_supported_operations;
    let stages = eleven.subgroup_supported_stages;
    operations.contains(vk::SubgroupFeatureFlags::VOTE)
        && stages.contains(vk::ShaderStageFlags::COMPUTE)
}

pub(super) fn has_timestamps(family: &vk::QueueFamilyProperties) -> bool {
    family.timestamp_valid_bits > 0
}

/// The bits of a timestamp that count.
pub(super) fn timestamp_mask(family: &vk::QueueFamilyProperties) -> u64 {
    let undefined = 64 - family.timestamp_valid_bits.min(64);
    u64::MAX.checked_shr(undefined).unwrap_or(0)
}

fn limits(limits: &vk::PhysicalDeviceLimits) -> [Need; 4] {
    [
        at_least(
            "maxComputeWorkGroupInvocations",
            GROUP_THREADS,
            limits.max_compute_work_group_invocations,
            "threads of a workgroup",
        ),
        at_least(
            "maxPerStageDescriptorStorageBuffers",
            STORAGE_BUFFERS,
            limits.max_per_stage_descriptor_storage_buffers,
            "buffers of a pass",
        ),
        at_least(
            "maxPerStageDescriptorStorageImages",
            STORAGE_IMAGES,
            limits.max_per_stage_descriptor_storage_images,
            "images that a pass writes",
        ),
        at_least(
            "maxPerStageDescriptorSampledImages",
            SAMPLED_IMAGES,
            limits.max_per_stage_descriptor_sampled_images,
            "images that a pass reads",
        ),
    ]
}

fn formats(instance: &Instance, physical: vk::PhysicalDevice) -> Vec<Need> {
    let row = |(name, format, is_written, reason): (_, _, bool, _)| {
        let found = format_features(instance, physical, format);
        let needed = if is_written {
            SAMPLED | STORED
        } else {
            SAMPLED
        };
        Need {
            name,
            needed: uses(needed),
            found: uses(found),
            holds: found.contains(needed),
            reason,
            fallback: None,
        }
    };
    FORMATS.map(row).to_vec()
}

/// The possible uses of images with these features, in words.
fn uses(features: vk::FormatFeatureFlags) -> String {
    let all = [
        (SAMPLED, "sampled"),
        (FILTERED, "filtered"),
        (STORED, "stored"),
    ];
    let present = all.iter().filter(|(flag, _)| features.contains(*flag));
    let names: Vec<_> = present.map(|(_, name)| *name).collect();
    if names.is_empty() {
        "nothing".into()
    } else {
        names.join(", ")
    }
}

/// Whether images of every format can be storage images.
pub(super) fn can_store_texels(instance: &Instance, physical: vk::PhysicalDevice) -> bool {
    let stores = |&(_, format, ..): &(_, vk::Format, bool, &str)| {
        format_features(instance, physical, format).contains(STORED)
    };
    FORMATS.iter().all(stores)
}

/// Whether all images can be read as storage images, and a pass can bind [`LOADED_IMAGES`] of them.
pub(super) fn can_load_texels(instance: &Instance, physical: vk::PhysicalDevice) -> bool {
    // SAFETY: `physical` belongs to the live instance.
    let limits = unsafe { instance.raw.get_physical_device_properties(physical) }.limits;
    limits.max_per_stage_descriptor_storage_images >= LOADED_IMAGES
        && can_store_texels(instance, physical)
}

fn format_features(
    instance: &Instance,
    physical: vk::PhysicalDevice,
    format: vk::Format,
) -> vk::FormatFeatureFlags {
    // SAFETY: `physical` belongs to the live instance.
    let properties = unsafe {
        instance
            .raw
            .get_physical_device_format_properties(physical, format)
    };
    properties.optimal_tiling_features
}
