//! The GPU memory that may be used, and the source of that limit.

use serde::Serialize;

use crate::gpu::Device;

/// A limit as set by a user.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Limit {
    Bytes(u64),
    /// Percent of the device-local heap, or of the memory that the host has free, in (0, 100].
    Percent(f64),
}

/// A limit in bytes.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Budget {
    pub bytes: u64,
    /// The source of the number, as the end of a sentence.
    pub source: String,
}

/// Bytes of the host's memory that a user allows; without a limit, half of what is free.
pub(crate) fn of_host(asked: Option<Limit>) -> u64 {
    let free = || {
        let mut system = sysinfo::System::new();
        system.refresh_memory();
        system.available_memory()
    };
    match asked {
        Some(Limit::Bytes(bytes)) => bytes,
        Some(Limit::Percent(share)) => (free() as f64 * share / 100.0) as u64,
        None => free() / 2,
    }
}

impl Budget {
    /// The budget that the user allows, but never more than the device's heap holds; without a limit, what the driver
    /// grants.
    pub(crate) fn of(device: &Device, asked: Option<Limit>) -> Budget {
        let heap = device.summary.device_local_bytes;
        let (bytes, source) = match asked {
            None => return Budget::of_driver(device),
            Some(Limit::Bytes(bytes)) => (bytes, "--vram-budget".to_string()),
            Some(Limit::Percent(share)) => (
                (heap as f64 * share / 100.0) as u64,
                format!("--vram-budget, {share} % of the heap"),
            ),
        };
        if bytes <= heap {
            Budget { bytes, source }
        } else {
            Budget {
                bytes: heap,
                source: format!("the heap, which is smaller than {source}"),
            }
        }
    }

    fn of_driver(device: &Device) -> Budget {
        let (bytes, source) = device.default_budget();
        Budget {
            bytes,
            source: source.into(),
        }
    }
}
