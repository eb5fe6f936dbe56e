//! The GPU memory that may be used, and the source of that limit.

use crate::gpu::Device;

/// A limit as set by a user.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Limit {
    Bytes(u64),
    /// Percent of the device-local heap, or of the memory that the host has free, in (0, 100].
    Percent(f64),
}

/// A limit in bytes.
#[derive(Debug, Clone, PartialEq)]
pub struct Budget {
    pub bytes: u64,
    pub source: BudgetSource,
}

/// Where a budget comes from.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum BudgetSource {
    /// What the driver says, in its words, as the end of a sentence.
    Driver(&'static str),
    /// The limit that the user has set.
    Limit(Limit),
    /// The heap, which is smaller than that limit.
    Heap(Limit),
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
        let Some(limit) = asked else {
            let (bytes, source) = device.default_budget();
            return Budget {
                bytes,
                source: BudgetSource::Driver(source),
            };
        };
        let heap = device.summary.device_local_bytes;
        let bytes = match limit {
            Limit::Bytes(bytes) => bytes,
            Limit::Percent(share) => (heap as f64 * share / 100.0) as u64,
        };
        if bytes <= heap {
            Budget {
                bytes,
                source: BudgetSource::Limit(limit),
            }
        } else {
            Budget {
                bytes: heap,
                source: BudgetSource::Heap(limit),
            }
        }
    }
}
