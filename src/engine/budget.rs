//! The memory that may be used, on the GPU and on the host, and the source of that limit.

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
    /// Half of what the host has free: on a CPU, the device's memory is the host's, which has to hold the rest as well.
    Host,
}

/// Bytes of the host's memory that a user allows; without a limit, half of what is free beside the device's budget, if that
/// is in the host's memory as well. (Half of what is free is counted of it at most: a budget is not always used.)
pub(crate) fn of_host(asked: Option<Limit>, free: u64, device: &Device, budget: &Budget) -> u64 {
    match asked {
        Some(Limit::Bytes(bytes)) => bytes,
        Some(Limit::Percent(share)) => (free as f64 * share / 100.0) as u64,
        None => {
            let is_shared = device.summary.kind.is_software();
            let of_device = if is_shared {
                budget.bytes.min(free / 2)
            } else {
                0
            };
            (free - of_device) / 2
        }
    }
}

impl Budget {
    /// The budget that the user allows, but never more than the device's heap holds; without a limit, what the driver
    /// grants, but no more than half of what the host has free where the device is a CPU.
    pub(crate) fn of(device: &Device, asked: Option<Limit>, free: u64) -> Budget {
        let Some(limit) = asked else {
            return Budget::by_default(device, free);
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

    fn by_default(device: &Device, free: u64) -> Budget {
        let (bytes, driver) = device.default_budget();
        let granted = Budget {
            bytes,
            source: BudgetSource::Driver(driver),
        };
        let of_host = Budget {
            bytes: free / 2,
            source: BudgetSource::Host,
        };
        if device.summary.kind.is_software() && of_host.bytes < granted.bytes {
            of_host
        } else {
            granted
        }
    }
}
