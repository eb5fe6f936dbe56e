//! The memory that may be used, on the GPU and on the host, and the source of that limit.

use crate::gpu::{Device, DeviceKind};

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
    /// Half of what the host has free, where the device's memory is the host's, which has to hold the rest as well.
    Host,
}

/// Bytes of the host's memory that a user allows; without a limit, half of what is free beside the device's budget, if that
/// is in the host's memory as well. (At most half of the free memory is attributed to the device's budget, since a budget is
/// not always used up.)
pub(crate) fn of_host(asked: Option<Limit>, free: u64, kind: DeviceKind, budget: &Budget) -> u64 {
    match asked {
        Some(Limit::Bytes(bytes)) => bytes,
        Some(Limit::Percent(share)) => (free as f64 * share / 100.0) as u64,
        None => {
            let of_device = if kind.shares_host_memory() {
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
    /// leaves, but no more than half of what the host has free where the device's memory is the host's.
    pub(crate) fn of(device: &Device, asked: Option<Limit>, free: u64) -> Budget {
        match asked {
            Some(limit) => Budget::limited(limit, device.summary.device_local_bytes),
            None => Budget::by_default(device.default_budget(), device.summary.kind, free),
        }
    }

    fn limited(limit: Limit, heap: u64) -> Budget {
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

    fn by_default((bytes, driver): (u64, &'static str), kind: DeviceKind, free: u64) -> Budget {
        let granted = Budget {
            bytes,
            source: BudgetSource::Driver(driver),
        };
        let of_host = Budget {
            bytes: free / 2,
            source: BudgetSource::Host,
        };
        if kind.shares_host_memory() && of_host.bytes < granted.bytes {
            of_host
        } else {
            granted
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_limit_holds_up_to_the_heap() {
        const HEAP: u64 = 8000;
        for (limit, bytes, is_the_heap) in [
            (Limit::Percent(25.0), 2000, false),
            (Limit::Percent(100.0), 8000, false),
            (Limit::Bytes(3000), 3000, false),
            (Limit::Bytes(8000), 8000, false),
            (Limit::Bytes(8001), 8000, true),
        ] {
            let source = if is_the_heap {
                BudgetSource::Heap(limit)
            } else {
                BudgetSource::Limit(limit)
            };
            assert_eq!(Budget::limited(limit, HEAP), Budget { bytes, source });
        }
    }

    #[test]
    fn by_default_a_device_gets_at_most_half_of_the_free_memory_that_it_shares() {
        let driver = BudgetSource::Driver("the driver");
        for (kind, free, bytes, source) in [
            (DeviceKind::Discrete, 1000, 6000, driver),
            (DeviceKind::Cpu, 16_000, 6000, driver),
            (DeviceKind::Cpu, 12_000, 6000, driver),
            (DeviceKind::Cpu, 10_000, 5000, BudgetSource::Host),
            (DeviceKind::Integrated, 10_000, 5000, BudgetSource::Host),
        ] {
            let budget = Budget::by_default((6000, "the driver"), kind, free);
            assert_eq!(budget, Budget { bytes, source }, "{kind}, {free} free");
        }
    }

    #[test]
    fn the_host_keeps_half_of_what_the_device_leaves_of_its_memory() {
        let (cpu, gpu) = (DeviceKind::Cpu, DeviceKind::Discrete);
        let integrated = DeviceKind::Integrated;
        for (asked, kind, budget, bytes) in [
            (Some(Limit::Bytes(20_000)), cpu, 4000, 20_000),
            (Some(Limit::Percent(30.0)), cpu, 4000, 3000),
            (None, gpu, 4000, 5000),
            (None, cpu, 4000, 3000),
            (None, integrated, 4000, 3000),
            // Of a budget above half of what is free, that half is counted.
            (None, cpu, 9000, 2500),
        ] {
            let budget = Budget {
                bytes: budget,
                source: BudgetSource::Driver("the driver"),
            };
            assert_eq!(
                of_host(asked, 10_000, kind, &budget),
                bytes,
                "{asked:?}, {kind}"
            );
        }
    }
}
