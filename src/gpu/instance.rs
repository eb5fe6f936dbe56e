//! The Vulkan instance, and the messages of its validation layers.
//!
//! Messages are kept until they are read. Those still unread when the instance is destroyed are printed: those that
//! came on the way to another error, and, since the messenger outlives the device, those about objects and memory
//! that were left alive when the device was destroyed. A device that is itself never destroyed is silent.

use std::ffi::{CStr, c_char, c_void};
use std::sync::atomic::{AtomicUsize, Ordering};
use std::sync::{Mutex, MutexGuard};

use ash::{ext, khr, vk};

use super::failure::failure;
use crate::error::{DeviceError, Error, Result};
use crate::locked::locked;

#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub enum Validation {
    #[default]
    Off,
    /// Core and synchronization validation; an error if the layer is not installed.
    On,
}

impl Validation {
    pub fn when(is_wanted: bool) -> Validation {
        if is_wanted {
            Validation::On
        } else {
            Validation::Off
        }
    }
}

/// Messages of the validation layers, in order of arrival.
type Messages = Mutex<Vec<String>>;

pub(super) struct Instance {
    pub raw: ash::Instance,
    /// Whether passes can be labelled for debuggers and profilers.
    pub has_labels: bool,
    messenger: Option<(ext::debug_utils::Instance, vk::DebugUtilsMessengerEXT)>,
    messages: Box<Messages>,
    /// How many of the messages have been read.
    heard: AtomicUsize,
    pub entry: ash::Entry,
}

const VALIDATION_LAYER: &CStr = c"VK_LAYER_KHRONOS_validation";

/// Held while an instance or a device is made or destroyed.
///
/// The validation layer finds its records by the address of the driver's tables, and forgets them after the tables are
/// freed. A table that another thread makes in between may get the same address: the layer then forgets the new record,
/// and crashes at the next call.
pub(super) fn one_at_a_time() -> MutexGuard<'static, ()> {
    static LIFETIMES: Mutex<()> = Mutex::new(());
    locked(&LIFETIMES)
}

/// Whether a list of extensions, if there is one, has this name.
fn has_name(all: ash::prelude::VkResult<Vec<vk::ExtensionProperties>>, name: &CStr) -> bool {
    all.is_ok_and(|all| all.iter().any(|e| e.extension_name_as_c_str() == Ok(name)))
}

/// What an instance is made with: the extensions that a window system needs, and others that the loader offers.
struct Wanted {
    /// C strings.
    extensions: Vec<*const c_char>,
    has_labels: bool,
    flags: vk::InstanceCreateFlags,
}

impl Wanted {
    fn of(entry: &ash::Entry, validation: Validation, extensions: &[&'static CStr]) -> Wanted {
        // SAFETY: the loader is alive.
        let offered = unsafe { entry.enumerate_instance_extension_properties(None) };
        let offers = |name| has_name(offered.clone(), name);
        let mut wanted = Wanted {
            extensions: extensions.iter().map(|name| name.as_ptr()).collect(),
            // Debuggers and profilers show the names of passes. The validation layers bring it along.
            has_labels: validation == Validation::On || offers(ext::debug_utils::NAME),
            flags: vk::InstanceCreateFlags::empty(),
        };
        if wanted.has_labels {
            wanted.extensions.push(ext::debug_utils::NAME.as_ptr());
        }
        // Without this, loaders leave out drivers that stand on another interface, as MoltenVK stands on Metal.
        if offers(khr::portability_enumeration::NAME) {
            let name = khr::portability_enumeration::NAME.as_ptr();
            wanted.extensions.push(name);
            wanted.flags |= vk::InstanceCreateFlags::ENUMERATE_PORTABILITY_KHR;
        }
        wanted
    }
}

fn why_not_made(error: vk::Result) -> Error {
    match error {
        vk::Result::ERROR_LAYER_NOT_PRESENT => DeviceError::NoValidation.into(),
        vk::Result::ERROR_INCOMPATIBLE_DRIVER => DeviceError::NoDriver.into(),
        vk::Result::ERROR_EXTENSION_NOT_PRESENT => DeviceError::Display(
            "no Vulkan driver here can draw into this display's windows; `isolume render` needs no window".into(),
        )
        .into(),
        e => failure(e, "Vulkan could not be started"),
    }
}

impl Instance {
    /// `extensions` are those that a window system needs.
    pub fn new(validation: Validation, extensions: &[&'static CStr]) -> Result<Instance> {
        // SAFETY: the loader is only used through this entry, which the instance keeps alive.
        let entry =
            unsafe { ash::Entry::load() }.map_err(|e| DeviceError::NoLoader(e.to_string()))?;
        let application = vk::ApplicationInfo::default()
            .application_name(c"isolume")
            .api_version(vk::API_VERSION_1_3);
        let mut layers = Vec::new();
        if validation == Validation::On {
            layers.push(VALIDATION_LAYER.as_ptr());
        }
        let Wanted {
            extensions,
            has_labels,
            flags,
        } = Wanted::of(&entry, validation, extensions);
        let checks = [vk::ValidationFeatureEnableEXT::SYNCHRONIZATION_VALIDATION];
        let mut features =
            vk::ValidationFeaturesEXT::default().enabled_validation_features(&checks);
        let mut info = vk::InstanceCreateInfo::default()
            .flags(flags)
            .application_info(&application)
            .enabled_layer_names(&layers)
            .enabled_extension_names(&extensions);
        if validation == Validation::On {
            info = info.push_next(&mut features);
        }
        let making = one_at_a_time();
        // SAFETY: every pointer in `info` outlives the call.
        let raw = unsafe { entry.create_instance(&info, None) };
        drop(making);
        let mut instance = Instance {
            raw: raw.map_err(why_not_made)?,
            has_labels,
            messenger: None,
            messages: Box::default(),
            heard: AtomicUsize::new(0),
            entry,
        };
        if validation == Validation::On {
            instance.listen()?;
        }
        Ok(instance)
    }

    pub fn physical_devices(&self) -> Result<Vec<vk::PhysicalDevice>> {
        // SAFETY: the instance is alive.
        unsafe { self.raw.enumerate_physical_devices() }
            .map_err(|e| failure(e, "Vulkan devices could not be listed"))
    }

    pub fn has_extension(&self, physical: vk::PhysicalDevice, name: &CStr) -> bool {
        // SAFETY: `physical` belongs to this live instance.
        let offered = unsafe { self.raw.enumerate_device_extension_properties(physical) };
        has_name(offered, name)
    }

    /// The messages of the validation layers so far.
    pub fn messages(&self) -> Vec<String> {
        let messages = locked(&self.messages);
        self.heard.store(messages.len(), Ordering::Relaxed);
        messages.clone()
    }

    fn listen(&mut self) -> Result<()> {
        let debug = ext::debug_utils::Instance::new(&self.entry, &self.raw);
        let info = vk::DebugUtilsMessengerCreateInfoEXT::default()
            .message_severity(
                vk::DebugUtilsMessageSeverityFlagsEXT::ERROR
                    | vk::DebugUtilsMessageSeverityFlagsEXT::WARNING,
            )
            // Warnings about performance are left out, since they would complain of images that stay in one layout.
            .message_type(vk::DebugUtilsMessageTypeFlagsEXT::VALIDATION)
            .pfn_user_callback(Some(keep_message))
            .user_data(&raw const *self.messages as *mut c_void);
        // SAFETY: `messages` is boxed, so its address holds until the messenger is destroyed.
        let messenger = unsafe { debug.create_debug_utils_messenger(&info, None) }
            .map_err(|e| failure(e, "the validation layers could not be listened to"))?;
        self.messenger = Some((debug, messenger));
        Ok(())
    }
}

/// # Safety
/// `user_data` points to the [`Messages`] of the instance that called.
unsafe extern "system" fn keep_message(
    _severity: vk::DebugUtilsMessageSeverityFlagsEXT,
    _kind: vk::DebugUtilsMessageTypeFlagsEXT,
    data: *const vk::DebugUtilsMessengerCallbackDataEXT<'_>,
    user_data: *mut c_void,
) -> vk::Bool32 {
    // SAFETY: Vulkan hands over a valid record, and `user_data` is what `listen` gave it.
    let (data, messages) = unsafe { (&*data, &*(user_data as *const Messages)) };
    // SAFETY: a non-null message is a C string for the length of the call.
    if let Some(text) = unsafe { data.message_as_c_str() } {
        locked(messages).push(text.to_string_lossy().into_owned());
    }
    vk::FALSE
}

impl Drop for Instance {
    fn drop(&mut self) {
        let ending = one_at_a_time();
        // SAFETY: everything made from the instance holds the device, which is gone by now.
        unsafe {
            if let Some((debug, messenger)) = self.messenger.take() {
                debug.destroy_debug_utils_messenger(messenger, None);
            }
            self.raw.destroy_instance(None);
        }
        drop(ending);
        let heard = self.heard.load(Ordering::Relaxed);
        for message in &self.messages()[heard..] {
            eprintln!("Vulkan validation: {message}");
        }
    }
}

pub(super) fn queue_families(
    instance: &Instance,
    physical: vk::PhysicalDevice,
) -> Vec<vk::QueueFamilyProperties> {
    // SAFETY: `physical` belongs to the live instance.
    unsafe {
        instance
            .raw
            .get_physical_device_queue_family_properties(physical)
    }
}
