//! Devices as their drivers describe them: what a plan knows of a device.

use isolume::gpu::{DeviceKind, DeviceSummary};

const MIB: u64 = 1 << 20;
const GIB: u64 = 1 << 30;

/// Drivers that have no other limit state the last 32-bit number.
const ANY_BUFFER: u64 = u32::MAX as u64;

fn device(name: &str, kind: DeviceKind, heap: u64) -> DeviceSummary {
    DeviceSummary {
        index: 0,
        name: name.into(),
        kind,
        driver: "none".into(),
        api: "1.3.0".into(),
        device_local_bytes: heap,
        max_image_2d: 16384,
        max_image_3d: 2048,
        max_storage_buffer_bytes: ANY_BUFFER,
        max_allocation_bytes: heap,
        extra_images: 15,
        lacks: Vec::new(),
        needs: Vec::new(),
    }
}

fn nvidia(name: &str, heap: u64) -> DeviceSummary {
    DeviceSummary {
        max_image_2d: 32768,
        max_image_3d: 16384,
        max_allocation_bytes: 0xffe0_0000,
        ..device(name, DeviceKind::Discrete, heap)
    }
}

pub fn nvidia_4() -> DeviceSummary {
    nvidia("NVIDIA GeForce GTX 1650", 4 * GIB)
}

pub fn nvidia_8() -> DeviceSummary {
    nvidia("NVIDIA GeForce RTX 3070", 8 * GIB)
}

pub fn nvidia_24() -> DeviceSummary {
    nvidia("NVIDIA GeForce RTX 4090", 24 * GIB)
}

pub fn nvidia_h100() -> DeviceSummary {
    nvidia("NVIDIA H100 80GB HBM3", 79 * GIB)
}

pub fn nvidia_80() -> DeviceSummary {
    nvidia("NVIDIA A100-SXM4-80GB", 80 * GIB)
}

pub fn nvidia_141() -> DeviceSummary {
    nvidia("NVIDIA H200", 141_000_000_000)
}

fn amd(name: &str, heap: u64) -> DeviceSummary {
    DeviceSummary {
        max_image_3d: 8192,
        max_allocation_bytes: 2 * GIB,
        ..device(name, DeviceKind::Discrete, heap)
    }
}

pub fn amd_4() -> DeviceSummary {
    amd("AMD Radeon RX 6500 XT", 4 * GIB)
}

pub fn amd_16() -> DeviceSummary {
    amd("AMD Radeon RX 7800 XT", 16 * GIB)
}

pub fn amd_24() -> DeviceSummary {
    amd("AMD Radeon RX 7900 XTX", 24 * GIB)
}

pub fn intel() -> DeviceSummary {
    DeviceSummary {
        max_storage_buffer_bytes: GIB,
        max_allocation_bytes: 4 * GIB,
        ..device(
            "Intel(R) Iris(R) Xe Graphics",
            DeviceKind::Integrated,
            12 * GIB,
        )
    }
}

/// A phone: its images are long and its memory small.
pub fn mali() -> DeviceSummary {
    DeviceSummary {
        max_image_2d: 65536,
        max_image_3d: 65536,
        max_storage_buffer_bytes: 2 * GIB,
        ..device("Mali-G615 MC6", DeviceKind::Integrated, 3677 * MIB)
    }
}

/// One memory for all.
pub fn apple() -> DeviceSummary {
    device("Apple M2", DeviceKind::Integrated, 11 * GIB)
}

pub fn lavapipe() -> DeviceSummary {
    DeviceSummary {
        max_image_3d: 4096,
        max_storage_buffer_bytes: 128 * MIB,
        ..device("llvmpipe", DeviceKind::Cpu, 2 * GIB)
    }
}

pub fn tiny() -> DeviceSummary {
    device("VideoCore", DeviceKind::Integrated, 128 * MIB)
}

/// The least that Vulkan allows.
pub fn minimum() -> DeviceSummary {
    DeviceSummary {
        max_image_2d: 4096,
        max_image_3d: 256,
        max_storage_buffer_bytes: 128 * MIB,
        max_allocation_bytes: GIB,
        extra_images: 0,
        ..device("the least of devices", DeviceKind::Other, 2 * GIB)
    }
}

/// One whose 3D images are so long.
pub fn with_short_images(longest: u32) -> DeviceSummary {
    DeviceSummary {
        max_image_3d: longest,
        ..minimum()
    }
}

pub fn with_small_buffers(bytes: u64) -> DeviceSummary {
    DeviceSummary {
        max_storage_buffer_bytes: bytes,
        ..minimum()
    }
}

pub fn with_small_allocations(bytes: u64) -> DeviceSummary {
    DeviceSummary {
        max_allocation_bytes: bytes,
        ..minimum()
    }
}
