//! The logical device with its single queue.
//!
//! Validation is a property of the device: with it on, core and synchronization checks run, and
//! every message is kept so that a test can demand that there were none.

use std::sync::{Arc, Mutex, MutexGuard};

use ash::{ext, khr, vk};

use super::failure::failure;
use super::instance::{Instance, Validation, one_at_a_time, queue_families};
use super::needs::{can_load_texels, can_store_texels, can_vote, has_timestamps, timestamp_mask};
use super::pipeline_cache::PipelineCache;
use super::shader;
use super::survey::{DeviceSummary, candidates, compute_queue, device_local_heap, survey};
use crate::error::{DeviceError, Result};
use crate::locked::locked;

/// Which device to open, and how closely it is watched.
#[derive(Debug, Clone, Default)]
pub struct DeviceChoice {
    /// An index of [`super::list_devices`], or a part of a name, in any case. `None`: the best device.
    pub wanted: Option<String>,
    pub validation: Validation,
    /// Whether shaders fetch texels in the way that suits a GPU, even on a CPU's driver, so that tests cover both
    /// ways.
    pub fetches_texels: bool,
}

/// Whether a queue family of a device can show images where it has to; what is wrong with it, if it cannot.
pub(super) type CanShow<'a> = &'a dyn Fn(vk::PhysicalDevice, u32) -> Result<(), String>;

/// An open device. Everything made from it holds an `Arc` of it.
pub struct Device {
    pub(super) raw: ash::Device,
    pub(super) labels: Option<ext::debug_utils::Device>,
    pub(super) physical: vk::PhysicalDevice,
    /// Behind a mutex, since Vulkan lets one thread at a time submit to a queue.
    queue: Mutex<vk::Queue>,
    pub(super) queue_family: u32,
    pub(super) timestamp_period_ns: f64,
    /// The bits of a timestamp that count; the others are undefined.
    pub(super) timestamp_mask: u64,
    /// The most workgroups of a dispatch along each axis.
    pub(super) most_groups: [u32; 3],
    pub(super) nearest: vk::Sampler,
    pub(super) linear: vk::Sampler,
    pub(super) pipelines: PipelineCache,
    /// The stages whose work a barrier has to wait for.
    pub(super) work_stages: vk::PipelineStageFlags2,
    /// Whether submissions are timed by the host's clock: where the queue writes no timestamps, and where a window is
    /// drawn by a CPU: Mesa's driver then writes them when it draws next, not where they were recorded.
    pub(super) timed_by_host: bool,
    /// Whether the queue writes timestamps.
    pub writes_timestamps: bool,
    has_memory_budget: bool,
    /// Whether shaders read images texel by texel as storage images: `glsl/include/texels.glsl`.
    pub loads_texels: bool,
    /// Whether threads that run together can vote: `glsl/include/slots.glsl`.
    votes: bool,
    /// Whether images of every format can be storage images.
    pub stores_texels: bool,
    pub summary: DeviceSummary,
    // Last: the instance goes after its device.
    pub(super) instance: Arc<Instance>,
}

impl Device {
    /// Opens the wanted device, or the best by its [`DeviceKind`](super::DeviceKind).
    pub fn open(choice: &DeviceChoice) -> Result<Arc<Device>> {
        let instance = Arc::new(Instance::new(choice.validation, &[])?);
        Device::open_from(instance, choice, None)
    }

    /// `can_show`: asked of devices that have to show images as well. The best device that can is opened, and where none can, the
    /// error is that of the best.
    pub(super) fn open_from(
        instance: Arc<Instance>,
        choice: &DeviceChoice,
        can_show: Option<CanShow<'_>>,
    ) -> Result<Arc<Device>> {
        let summaries = survey(&instance)?;
        let physical = instance.physical_devices()?;
        let mut problem = None;
        for summary in candidates(&summaries, choice.wanted.as_deref())? {
            let physical = physical[summary.index];
            match usable_queue(&instance, physical, summary, can_show) {
                Ok(family) => {
                    let (summary, draws) = (summary.clone(), can_show.is_some());
                    let fetches = choice.fetches_texels;
                    return Device::create(instance, physical, summary, family, draws, fetches);
                }
                Err(e) => problem = problem.or(Some(e)),
            }
        }
        Err(problem.expect("at least one candidate"))
    }

    fn create(
        instance: Arc<Instance>,
        physical: vk::PhysicalDevice,
        summary: DeviceSummary,
        queue_family: u32,
        draws: bool,
        fetches_texels: bool,
    ) -> Result<Arc<Device>> {
        let family = queue_families(&instance, physical)[queue_family as usize];
        let stores_texels = can_store_texels(&instance, physical);
        let loads_texels =
            !fetches_texels && summary.kind.is_software() && can_load_texels(&instance, physical);
        let has_memory_budget = instance.has_extension(physical, ext::memory_budget::NAME);
        let raw = logical_device(&instance, physical, queue_family, has_memory_budget, draws)
            .map_err(|e| failure(e, format!("{} could not be opened", summary.name)))?;
        // SAFETY: the family and index are the ones that the device was created with.
        let queue = unsafe { raw.get_device_queue(queue_family, 0) };
        // SAFETY: `physical` belongs to the live instance.
        let properties = unsafe { instance.raw.get_physical_device_properties(physical) };
        let limits = properties.limits;
        let labels = instance
            .has_labels
            .then(|| ext::debug_utils::Device::new(&instance.raw, &raw));
        let mut device = Device {
            labels,
            pipelines: PipelineCache::load(&raw, &properties, shader::compiled()),
            raw,
            physical,
            queue: Mutex::new(queue),
            queue_family,
            timestamp_period_ns: limits.timestamp_period as f64,
            most_groups: limits.max_compute_work_group_count,
            nearest: vk::Sampler::null(),
            linear: vk::Sampler::null(),
            work_stages: if draws {
                vk::PipelineStageFlags2::ALL_COMMANDS
            } else {
                vk::PipelineStageFlags2::COMPUTE_SHADER | vk::PipelineStageFlags2::ALL_TRANSFER
            },
            timestamp_mask: timestamp_mask(&family),
            writes_timestamps: has_timestamps(&family),
            timed_by_host: !has_timestamps(&family) || draws && summary.kind.is_software(),
            has_memory_budget,
            loads_texels,
            stores_texels,
            votes: can_vote(&instance, physical),
            summary,
            instance,
        };
        device.nearest = device.sampler(vk::Filter::NEAREST)?;
        device.linear = device.sampler(vk::Filter::LINEAR)?;
        Ok(Arc::new(device))
    }

    /// The queue, for this thread alone until the guard is dropped.
    pub(super) fn queue(&self) -> MutexGuard<'_, vk::Queue> {
        locked(&self.queue)
    }

    fn sampler(&self, filter: vk::Filter) -> Result<vk::Sampler> {
        let clamp = vk::SamplerAddressMode::CLAMP_TO_EDGE;
        let info = vk::SamplerCreateInfo::default()
            .mag_filter(filter)
            .min_filter(filter)
            .address_mode_u(clamp)
            .address_mode_v(clamp)
            .address_mode_w(clamp);
        // SAFETY: `info` is valid; destroyed in Drop.
        unsafe { self.raw.create_sampler(&info, None) }
            .map_err(|e| failure(e, format!("{} has made no sampler", self.summary.name)))
    }

    /// Macros that tell shaders how this device wants to be driven.
    pub(super) fn macros(&self) -> Vec<(&'static str, &'static str)> {
        let mut macros = Vec::new();
        // `glsl/include/texels.glsl`.
        macros.extend(self.loads_texels.then_some(("LOADS_TEXELS", "1")));
        // `glsl/include/slots.glsl`.
        macros.extend(self.votes.then_some(("VOTES", "1")));
        // `glsl/include/loop.glsl`.
        macros.extend(
            self.summary
                .kind
                .is_software()
                .then_some(("IS_SOFTWARE", "1")),
        );
        macros
    }

    /// Whether images of this format can be filtered linearly.
    pub fn filters(&self, format: vk::Format) -> bool {
        // SAFETY: `physical` belongs to the live instance.
        let properties = unsafe {
            self.instance
                .raw
                .get_physical_device_format_properties(self.physical, format)
        };
        properties
            .optimal_tiling_features
            .contains(vk::FormatFeatureFlags::SAMPLED_IMAGE_FILTER_LINEAR)
    }

    /// Bytes that Isolume may use unless a limit is set: 95 % of what the driver says is left, or 80 % of the device-local
    /// heap where it does not say; and the source of that number in words. A plan does not count what drivers take for
    /// themselves, such as compiled passes and the padding of allocations.
    pub fn default_budget(&self) -> (u64, &'static str) {
        let mut budget = vk::PhysicalDeviceMemoryBudgetPropertiesEXT::default();
        let mut memory = vk::PhysicalDeviceMemoryProperties2::default();
        if self.has_memory_budget {
            memory = memory.push_next(&mut budget);
        }
        // SAFETY: `physical` belongs to the live instance, and the chain outlives the call.
        unsafe {
            self.instance
                .raw
                .get_physical_device_memory_properties2(self.physical, &mut memory)
        };
        let memory = memory.memory_properties;
        let heap = device_local_heap(&memory);
        if self.has_memory_budget {
            let left = budget.heap_budget[heap].saturating_sub(budget.heap_usage[heap]);
            (left / 20 * 19, "95 % of what the driver says is left")
        } else {
            (
                memory.memory_heaps[heap].size / 5 * 4,
                "80 % of the device's heap, since the driver names no budget",
            )
        }
    }

    /// The messages of the validation layers so far.
    pub fn validation_messages(&self) -> Vec<String> {
        self.instance.messages()
    }
}

/// The family of the queue that is used; fails where the device has none that computes, and, if that is asked, draws and
/// shows images.
fn usable_queue(
    instance: &Instance,
    physical: vk::PhysicalDevice,
    summary: &DeviceSummary,
    can_show: Option<CanShow<'_>>,
) -> Result<u32> {
    let family = compute_queue(instance, physical, can_show.is_some());
    let device = summary.name.clone();
    let Some(can_show) = can_show else {
        let problem = "has no compute queue".into();
        return family.ok_or_else(|| DeviceError::Unable { device, problem }.into());
    };
    let shown = if !instance.has_extension(physical, khr::swapchain::NAME) {
        Err("lacks VK_KHR_swapchain, which a window needs".into())
    } else if let Some(family) = family {
        can_show(physical, family).map(|()| family)
    } else {
        Err("has no queue that both computes and draws, which a window needs".into())
    };
    shown.map_err(|problem| DeviceError::ShowsNothing { device, problem }.into())
}

/// Opens a device with one queue of a family. The survey has found every feature present.
fn logical_device(
    instance: &Instance,
    physical: vk::PhysicalDevice,
    queue_family: u32,
    has_memory_budget: bool,
    draws: bool,
) -> std::result::Result<ash::Device, vk::Result> {
    let queues = [vk::DeviceQueueCreateInfo::default()
        .queue_family_index(queue_family)
        .queue_priorities(&[1.0])];
    let mut extensions = Vec::new();
    if draws {
        extensions.push(khr::swapchain::NAME.as_ptr());
    }
    if has_memory_budget {
        extensions.push(ext::memory_budget::NAME.as_ptr());
    }
    // A driver that has it demands it.
    if instance.has_extension(physical, khr::portability_subset::NAME) {
        extensions.push(khr::portability_subset::NAME.as_ptr());
    }
    let features =
        vk::PhysicalDeviceFeatures::default().shader_storage_image_extended_formats(true);
    let mut vulkan_12 = vk::PhysicalDeviceVulkan12Features::default().scalar_block_layout(true);
    let mut vulkan_13 = vk::PhysicalDeviceVulkan13Features::default()
        .synchronization2(true)
        .maintenance4(true)
        .dynamic_rendering(draws);
    let info = vk::DeviceCreateInfo::default()
        .queue_create_infos(&queues)
        .enabled_extension_names(&extensions)
        .enabled_features(&features)
        .push_next(&mut vulkan_12)
        .push_next(&mut vulkan_13);
    let _making = one_at_a_time();
    // SAFETY: the chain outlives the call, and every feature is present.
    unsafe { instance.raw.create_device(physical, &info, None) }
}

impl Drop for Device {
    fn drop(&mut self) {
        let _ending = one_at_a_time();
        // SAFETY: the last `Arc` is gone, and with it every object made from the device.
        unsafe {
            let _ = self.raw.device_wait_idle();
            self.pipelines.end(&self.raw);
            self.raw.destroy_sampler(self.nearest, None);
            self.raw.destroy_sampler(self.linear, None);
            self.raw.destroy_device(None);
        }
    }
}
