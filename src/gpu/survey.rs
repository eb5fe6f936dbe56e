//! Lists the devices and their abilities, and chooses one.

use std::ffi::CStr;
use std::fmt;

use ash::vk;

use super::instance::{Instance, Validation, queue_families};
use super::needs::{Need, extra_images, has_timestamps, needs};
use crate::error::{DeviceError, Result};

/// The kind of hardware behind a driver, best first.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub enum DeviceKind {
    Discrete,
    Integrated,
    Virtual,
    Cpu,
    Other,
}

impl DeviceKind {
    /// Whether shaders run on the host's processor. Such a device is some hundred times as slow as a GPU, has few
    /// threads, and reads storage images faster than textures.
    pub fn is_software(self) -> bool {
        self == DeviceKind::Cpu
    }

    /// Whether the device's memory is the host's as well.
    pub fn shares_host_memory(self) -> bool {
        matches!(self, DeviceKind::Cpu | DeviceKind::Integrated)
    }
}

impl fmt::Display for DeviceKind {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            DeviceKind::Discrete => "discrete GPU",
            DeviceKind::Integrated => "integrated GPU",
            DeviceKind::Virtual => "virtual GPU",
            DeviceKind::Cpu => "CPU",
            DeviceKind::Other => "other",
        })
    }
}

impl serde::Serialize for DeviceKind {
    fn serialize<S: serde::Serializer>(
        &self,
        serializer: S,
    ) -> std::result::Result<S::Ok, S::Error> {
        serializer.collect_str(self)
    }
}

/// What `isolume info` shows of a device.
#[derive(Debug, Clone, serde::Serialize)]
pub struct DeviceSummary {
    /// Place in the driver's list.
    pub index: usize,
    pub name: String,
    pub kind: DeviceKind,
    /// Name and version, as the driver states them.
    pub driver: String,
    /// Version of Vulkan.
    pub api: String,
    pub device_local_bytes: u64,
    /// Most texels along a side of a 2D image.
    pub max_image_2d: u32,
    /// The same of a 3D image.
    pub max_image_3d: u32,
    pub max_storage_buffer_bytes: u64,
    pub max_allocation_bytes: u64,
    /// Images that a pass may read in addition to those of the table of needs.
    pub extra_images: u32,
    /// What the device lacks and cannot be used without, as in "scalarBlockLayout (for structs that shaders and Rust
    /// share)"; empty if Isolume can use it.
    pub lacks: Vec<String>,
    /// Everything that Isolume asks of the device.
    pub needs: Vec<Need>,
}

/// Every device that a Vulkan driver shows, usable or not.
pub fn list_devices() -> Result<Vec<DeviceSummary>> {
    survey(&Instance::new(Validation::Off, &[])?)
}

pub(super) fn survey(instance: &Instance) -> Result<Vec<DeviceSummary>> {
    let devices = instance.physical_devices()?;
    let numbered = devices.into_iter().enumerate();
    Ok(numbered
        .map(|(index, physical)| summarize(instance, index, physical))
        .collect())
}

fn summarize(instance: &Instance, index: usize, physical: vk::PhysicalDevice) -> DeviceSummary {
    let mut driver = vk::PhysicalDeviceDriverProperties::default();
    let mut third = vk::PhysicalDeviceMaintenance3Properties::default();
    let mut fourth = vk::PhysicalDeviceMaintenance4Properties::default();
    let mut properties = vk::PhysicalDeviceProperties2::default()
        .push_next(&mut driver)
        .push_next(&mut third)
        .push_next(&mut fourth);
    // SAFETY: `physical` belongs to the live instance.
    let memory = unsafe {
        instance
            .raw
            .get_physical_device_properties2(physical, &mut properties);
        instance.raw.get_physical_device_memory_properties(physical)
    };
    let properties = properties.properties;
    let needs = needs(instance, physical);
    let api = properties.api_version;
    let kind = match properties.device_type {
        vk::PhysicalDeviceType::DISCRETE_GPU => DeviceKind::Discrete,
        vk::PhysicalDeviceType::INTEGRATED_GPU => DeviceKind::Integrated,
        vk::PhysicalDeviceType::VIRTUAL_GPU => DeviceKind::Virtual,
        vk::PhysicalDeviceType::CPU => DeviceKind::Cpu,
        _ => DeviceKind::Other,
    };
    DeviceSummary {
        index,
        name: text(properties.device_name_as_c_str()),
        kind,
        driver: format!(
            "{} {}",
            text(driver.driver_name_as_c_str()),
            text(driver.driver_info_as_c_str())
        ),
        api: format!(
            "{}.{}.{}",
            vk::api_version_major(api),
            vk::api_version_minor(api),
            vk::api_version_patch(api)
        ),
        device_local_bytes: memory.memory_heaps_as_slice()[device_local_heap(&memory)].size,
        max_image_2d: properties.limits.max_image_dimension2_d,
        max_image_3d: properties.limits.max_image_dimension3_d,
        max_storage_buffer_bytes: match fourth.max_buffer_size {
            // Before Vulkan 1.3.
            0 => properties.limits.max_storage_buffer_range as u64,
            most => most.min(properties.limits.max_storage_buffer_range as u64),
        },
        max_allocation_bytes: third.max_memory_allocation_size,
        extra_images: extra_images(&properties.limits, kind.is_software()),
        lacks: needs.iter().filter_map(Need::shortcoming).collect(),
        needs,
    }
}

fn text(name: std::result::Result<&CStr, std::ffi::FromBytesUntilNulError>) -> String {
    name.map(|s| s.to_string_lossy().into_owned())
        .unwrap_or_default()
}

/// The largest device-local heap.
pub(super) fn device_local_heap(memory: &vk::PhysicalDeviceMemoryProperties) -> usize {
    let heaps = memory.memory_heaps_as_slice();
    (0..heaps.len())
        .filter(|&h| heaps[h].flags.contains(vk::MemoryHeapFlags::DEVICE_LOCAL))
        .max_by_key(|&h| heaps[h].size)
        .unwrap_or(0)
}

/// The queue family for computing, preferably one that writes timestamps, and that can also draw: it has to where
/// `draws`, as for a window.
pub(super) fn compute_queue(
    instance: &Instance,
    physical: vk::PhysicalDevice,
    draws: bool,
) -> Option<u32> {
    let families = queue_families(instance, physical);
    let computes = |f: &vk::QueueFamilyProperties| f.queue_flags.contains(vk::QueueFlags::COMPUTE);
    let can_draw = |f: &vk::QueueFamilyProperties| f.queue_flags.contains(vk::QueueFlags::GRAPHICS);
    let (index, _) = (0..)
        .zip(&families)
        .filter(|(_, f)| computes(f) && (can_draw(f) || !draws))
        .min_by_key(|(_, f)| (!has_timestamps(f), !can_draw(f)))?;
    Some(index)
}

/// The wanted device, by an index that there is or by a part of a name; or all that can be used, the best first by their
/// [`DeviceKind`]. The list is never empty.
pub(super) fn candidates<'a>(
    all: &'a [DeviceSummary],
    wanted: Option<&str>,
) -> Result<Vec<&'a DeviceSummary>> {
    let listing = || {
        let names: Vec<String> = all
            .iter()
            .map(|d| {
                if d.lacks.is_empty() {
                    format!("{}: {}", d.index, d.name)
                } else {
                    format!(
                        "{}: {}, which lacks {}",
                        d.index,
                        d.name,
                        d.lacks.join(", ")
                    )
                }
            })
            .collect();
        if names.is_empty() {
            "there is none".to_string()
        } else {
            format!("found: {}", names.join("; "))
        }
    };
    let Some(wanted) = wanted else {
        let mut usable: Vec<_> = all.iter().filter(|d| d.lacks.is_empty()).collect();
        usable.sort_by_key(|d| d.kind);
        if usable.is_empty() {
            let found = listing();
            return Err(DeviceError::NoneUsable { found }.into());
        }
        return Ok(usable);
    };
    let numbered = wanted.parse().ok().and_then(|index: usize| all.get(index));
    let is_named = |d: &&DeviceSummary| is_in_name(wanted, &d.name);
    // One device may be shown by two drivers, one of which cannot be used.
    let usable = all.iter().filter(|d| d.lacks.is_empty()).find(is_named);
    let named = usable.or_else(|| all.iter().find(is_named));
    let found = numbered.or(named);
    let found = found.ok_or_else(|| DeviceError::NotFound {
        wanted: wanted.into(),
        found: listing(),
    })?;
    if found.lacks.is_empty() {
        Ok(vec![found])
    } else {
        Err(DeviceError::Lacks {
            wanted: wanted.into(),
            device: found.name.clone(),
            lacks: found.lacks.iter().map(ToString::to_string).collect(),
        }
        .into())
    }
}

/// Whether this is a part of a device's name. A number has to be a whole word of it: "1" is an index, although there is a 1
/// in "llvmpipe (LLVM 15.0.6, 256 bits)".
fn is_in_name(wanted: &str, name: &str) -> bool {
    if wanted.bytes().all(|byte| byte.is_ascii_digit()) {
        let mut words = name.split(|c: char| c.is_whitespace() || "(),".contains(c));
        words.any(|word| word == wanted)
    } else {
        name.to_lowercase().contains(&wanted.to_lowercase())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn a_device() -> DeviceSummary {
        let instance = Instance::new(Validation::Off, &[]).expect("Vulkan");
        survey(&instance).expect("devices").swap_remove(0)
    }

    #[test]
    fn a_number_may_be_a_part_of_a_name() {
        let named = |name: &str| DeviceSummary {
            name: name.into(),
            lacks: Vec::new(),
            ..a_device()
        };
        let software = "llvmpipe (LLVM 15.0.6, 256 bits)";
        let all = [software, "NVIDIA GeForce RTX 3090", "Radeon 0"].map(named);
        let chosen = |wanted| candidates(&all, Some(wanted)).map(|d| d[0].name.clone());
        assert_eq!(chosen("3090").ok(), Some(all[1].name.clone()));
        assert_eq!(chosen("0").ok(), Some(all[0].name.clone()));
        assert!(chosen("3080").is_err());
        // Three devices have the indices 0 to 2.
        assert!(chosen("5").is_err());
        assert!(chosen("15").is_err());
    }

    #[test]
    fn the_best_kind_comes_first_and_an_index_or_a_part_of_a_name_picks_another() {
        let of = |(index, (kind, name)): (usize, (DeviceKind, &str))| DeviceSummary {
            index,
            name: name.into(),
            kind,
            lacks: Vec::new(),
            ..a_device()
        };
        let kinds = [
            (DeviceKind::Cpu, "llvmpipe"),
            (DeviceKind::Integrated, "Intel Iris"),
            (DeviceKind::Discrete, "Radeon Pro"),
        ];
        let all: Vec<_> = kinds.into_iter().enumerate().map(of).collect();
        let chosen = |wanted| -> Vec<usize> {
            let devices = candidates(&all, wanted).expect("a device");
            devices.iter().map(|device| device.index).collect()
        };
        assert_eq!(chosen(None), [2, 1, 0]);
        assert_eq!(chosen(Some("0")), [0]);
        assert_eq!(chosen(Some("1")), [1]);
        assert_eq!(chosen(Some("iris")), [1]);
        assert_eq!(chosen(Some("radeon")), [2]);
    }

    #[test]
    fn an_unusable_device_is_named_with_what_it_lacks() {
        let mut device = a_device();
        device.lacks = vec!["scalarBlockLayout (for structs)".into()];
        let message = |wanted| match candidates(std::slice::from_ref(&device), wanted) {
            Ok(_) => panic!("an unusable device was chosen"),
            Err(e) => e.to_string(),
        };
        let shortcoming = format!(
            "{}, which lacks scalarBlockLayout (for structs)",
            device.name
        );
        assert!(message(None).contains(&shortcoming), "{}", message(None));
        assert!(message(Some("0")).contains("scalarBlockLayout"));
    }
}
