//! The user's view of a Vulkan call's error: memory that ran out, a device that was lost, or one that does not work.

use std::fmt::Display;

use ash::vk;

use crate::error::{DeviceError, Error, MemoryError};

/// `what` names the operation that has failed, as in "image mean could not be made".
pub(super) fn failure(error: vk::Result, what: impl Display) -> Error {
    let what = what.to_string();
    match error {
        vk::Result::ERROR_OUT_OF_DEVICE_MEMORY => MemoryError::Device { what }.into(),
        vk::Result::ERROR_OUT_OF_HOST_MEMORY => MemoryError::Host { what }.into(),
        vk::Result::ERROR_DEVICE_LOST => DeviceError::Lost { what }.into(),
        _ => {
            let why = error.to_string();
            DeviceError::Call { what, why }.into()
        }
    }
}
