//! What a Vulkan call's error is to the user: memory that ran out, or a device that does not work.

use ash::vk;

use crate::error::{DeviceError, Error, MemoryError};

/// `doing` begins the sentence, such as "image film".
pub(super) fn failure(error: vk::Result, doing: String) -> Error {
    let why = error.to_string();
    match error {
        vk::Result::ERROR_OUT_OF_DEVICE_MEMORY | vk::Result::ERROR_OUT_OF_HOST_MEMORY => {
            MemoryError::Call { doing, why }.into()
        }
        _ => DeviceError::Call { doing, why }.into(),
    }
}
