//! Devices that are not there, cannot do what is needed, or fail.

#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
pub enum DeviceError {
    #[error(
        "no Vulkan loader was found ({0}): install libvulkan1 and a driver, for example mesa-vulkan-drivers"
    )]
    NoLoader(String),
    #[error("no Vulkan driver was found: install one, for example mesa-vulkan-drivers for the CPU")]
    NoDriver,
    #[error(
        "validation was asked for, but VK_LAYER_KHRONOS_validation is not installed (Debian: vulkan-validationlayers)"
    )]
    NoValidation,
    /// None of the devices can be used; `found` lists them with what each lacks.
    #[error(
        "no Vulkan 1.3 device can be used ({found}): install a driver, for example mesa-vulkan-drivers for the CPU"
    )]
    NoneUsable { found: String },
    /// There is no device of this name or number.
    #[error("{wanted}: no such Vulkan device; {found}")]
    NotFound { wanted: String, found: String },
    /// The device that was asked for cannot be used.
    #[error("{wanted}: {device} lacks {}", .lacks.join(", "))]
    Lacks {
        wanted: String,
        device: String,
        lacks: Vec<String>,
    },
    /// The device cannot do what this scene or program needs.
    #[error("{device} {problem}")]
    Unable { device: String, problem: String },
    /// The device cannot show pictures in a window.
    #[error("{device} {problem}")]
    ShowsNothing { device: String, problem: String },
    /// There is no display, or nothing can be drawn on it.
    #[error("{0}")]
    Display(String),
    /// A shader or a pass does not fit the device or the program.
    #[error("{part}: {problem}")]
    Program { part: String, problem: String },
    /// The driver has given the device up.
    #[error("{what}: the device was lost, as when its driver is reset; run the same command again")]
    Lost { what: String },
    /// A call failed.
    #[error("{what}: {why}")]
    Call { what: String, why: String },
    /// The validation layers found a fault.
    #[error("Vulkan validation: {0}")]
    Validation(String),
}
