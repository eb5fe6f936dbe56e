//! The one gate through which all GPU memory goes: it knows the budget, the bytes in use, and the peak.
//!
//! Every resource gets a dedicated allocation of exactly the size that Vulkan requires. There are few resources and
//! they are large, so nothing is gained by sharing blocks, and exactly what is planned is allocated, to the byte.
//!
//! A gate can be a *dry run*: resources made through it are null, but counted. The plan is the dry run of the very
//! code that allocates, so the two cannot drift apart.

use std::sync::atomic::{AtomicUsize, Ordering};
use std::sync::{Arc, LazyLock, Mutex, MutexGuard};
use std::time::Instant;

use ash::vk;
use gpu_allocator::vulkan::{
    Allocation, AllocationCreateDesc, AllocationScheme, Allocator, AllocatorCreateDesc,
};
use gpu_allocator::{AllocationError, AllocationSizes, AllocatorDebugSettings, MemoryLocation};

use super::device::Device;
use super::survey::DeviceSummary;
use crate::error::{DeviceError, MemoryError, Result};
use crate::locked::locked;

/// One named resource and its size.
#[derive(Debug, Clone, PartialEq, Eq, serde::Serialize)]
pub struct ResourceBytes {
    pub name: &'static str,
    pub bytes: u64,
}

pub struct Memory {
    /// The limits of the device, or of the one that a plan is made for.
    pub limits: DeviceSummary,
    pub budget: u64,
    ledger: Mutex<Ledger>,
    /// `None` in a dry run.
    allocator: Option<Mutex<Allocator>>,
    // Last: the device goes after the allocator.
    pub(super) device: Arc<Device>,
}

#[derive(Default)]
struct Ledger {
    used: u64,
    peak: u64,
    /// The resources that were alive at the peak.
    at_peak: Vec<ResourceBytes>,
    /// Bytes in use from each moment on.
    history: Vec<(Instant, u64)>,
    alive: Vec<ResourceBytes>,
}

impl Ledger {
    fn use_now(&mut self, bytes: u64) {
        self.used = bytes;
        self.history.push((Instant::now(), bytes));
    }

    fn note_peak(&mut self) {
        if self.used > self.peak {
            self.peak = self.used;
            self.at_peak = self.alive.clone();
        }
    }
}

/// A resource's share of the gate's memory, which is given back when this is dropped.
pub(super) struct Holding {
    memory: Arc<Memory>,
    entry: ResourceBytes,
    allocation: Option<Allocation>,
}

/// The resource that a dedicated allocation is for.
pub(super) enum Owner {
    Image(vk::Image),
    Buffer(vk::Buffer),
}

impl Memory {
    pub fn new(device: &Arc<Device>, budget: u64) -> Result<Arc<Memory>> {
        let allocator = Allocator::new(&AllocatorCreateDesc {
            instance: device.instance.raw.clone(),
            device: device.raw.clone(),
            physical_device: device.physical,
            debug_settings: AllocatorDebugSettings::default(),
            buffer_device_address: false,
            allocation_sizes: AllocationSizes::default(),
        })
        .map_err(|e| DeviceError::Call {
            what: "the memory allocator did not start".into(),
            why: e.to_string(),
        })?;
        Ok(Arc::new(Memory {
            device: device.clone(),
            limits: device.summary.clone(),
            budget,
            ledger: Mutex::default(),
            allocator: Some(Mutex::new(allocator)),
        }))
    }

    /// A gate that counts and allocates nothing. It has no budget, and checks sizes against `limits`, which may be
    /// those of another device.
    pub fn dry_run(device: &Arc<Device>, limits: DeviceSummary) -> Arc<Memory> {
        Arc::new(Memory {
            device: device.clone(),
            limits,
            budget: u64::MAX,
            ledger: Mutex::default(),
            allocator: None,
        })
    }

    pub fn device(&self) -> &Arc<Device> {
        &self.device
    }

    pub(super) fn is_dry_run(&self) -> bool {
        self.allocator.is_none()
    }

    /// Bytes in use now.
    pub fn used(&self) -> u64 {
        self.ledger().used
    }

    /// The most that was ever allocated at once, in bytes.
    pub fn peak(&self) -> u64 {
        self.ledger().peak
    }

    /// The resources that are there now, in order of allocation.
    pub fn resources(&self) -> Vec<ResourceBytes> {
        self.ledger().alive.clone()
    }

    /// The resources that were there at the peak, in order of allocation.
    pub fn resources_at_peak(&self) -> Vec<ResourceBytes> {
        self.ledger().at_peak.clone()
    }

    /// Bytes in use from each moment on, for a profile.
    pub fn history(&self) -> Vec<(Instant, u64)> {
        self.ledger().history.clone()
    }

    fn ledger(&self) -> MutexGuard<'_, Ledger> {
        locked(&self.ledger)
    }

    /// Enters `requirements.size` bytes in the ledger; fails where they exceed the budget or the device's limit.
    pub(super) fn reserve(
        self: &Arc<Self>,
        name: &'static str,
        requirements: &vk::MemoryRequirements,
    ) -> Result<Holding> {
        let bytes = requirements.size;
        let limit = self.limits.max_allocation_bytes;
        if bytes > limit {
            return Err(MemoryError::Allocation {
                resource: name.into(),
                bytes,
                device: self.limits.name.clone(),
                limit,
            }
            .into());
        }
        let mut ledger = self.ledger();
        let used = ledger.used + bytes;
        if used > self.budget {
            return Err(MemoryError::Budget {
                resource: name.into(),
                bytes,
                used: ledger.used,
                budget: self.budget,
            }
            .into());
        }
        let entry = ResourceBytes { name, bytes };
        ledger.use_now(used);
        ledger.alive.push(entry.clone());
        if self.is_dry_run() {
            ledger.note_peak();
        }
        Ok(Holding {
            memory: self.clone(),
            entry,
            allocation: None,
        })
    }
}

impl Holding {
    /// Allocates the reserved bytes for their one owner.
    pub fn allocate(
        &mut self,
        requirements: vk::MemoryRequirements,
        location: MemoryLocation,
        owner: Owner,
    ) -> Result<&Allocation> {
        let allocator = self.memory.allocator.as_ref();
        let allocator = allocator.expect("a dry run has no owners to allocate for");
        let desc = AllocationCreateDesc {
            name: self.entry.name,
            requirements,
            location,
            linear: matches!(owner, Owner::Buffer(_)),
            allocation_scheme: match owner {
                Owner::Image(image) => AllocationScheme::DedicatedImage(image),
                Owner::Buffer(buffer) => AllocationScheme::DedicatedBuffer(buffer),
            },
        };
        let allocation = if shall_fail() {
            Err(AllocationError::OutOfMemory)
        } else {
            locked(allocator).allocate(&desc)
        };
        // The allocator fails for lack of device memory or of host memory, or because memory cannot be mapped. It tells some
        // of these apart only in its text, which therefore goes into the message; the remedy is the same.
        let allocation = allocation.map_err(|e| MemoryError::Refused {
            resource: self.entry.name.into(),
            bytes: self.entry.bytes,
            device: self.memory.device.summary.name.clone(),
            why: e.to_string(),
        })?;
        self.note_allocated();
        Ok(self.allocation.insert(allocation))
    }

    /// Notes that the reserved bytes are allocated: what a driver refuses is no part of the peak.
    pub fn note_allocated(&self) {
        self.memory.ledger().note_peak();
    }

    pub fn allocation(&self) -> Option<&Allocation> {
        self.allocation.as_ref()
    }

    pub fn device(&self) -> &Arc<Device> {
        &self.memory.device
    }

    pub fn memory(&self) -> Arc<Memory> {
        self.memory.clone()
    }

    pub fn name(&self) -> &'static str {
        self.entry.name
    }
}

impl Holding {
    /// Gives everything back; the holding is empty from then on.
    pub fn release(&mut self) {
        if let (Some(allocation), Some(allocator)) =
            (self.allocation.take(), self.memory.allocator.as_ref())
        {
            // Freeing fails only for memory that is not the allocator's own.
            let _ = locked(allocator).free(allocation);
        }
        let mut ledger = self.memory.ledger();
        if let Some(index) = ledger.alive.iter().position(|e| *e == self.entry) {
            ledger.alive.remove(index);
            let used = ledger.used - self.entry.bytes;
            ledger.use_now(used);
        }
        self.entry.bytes = 0;
    }
}

impl Drop for Holding {
    fn drop(&mut self) {
        self.release();
    }
}

/// `ISOLUME_FAIL_ALLOCATION=n` lets the process's allocation n, counted from 0, fail as if the driver had no memory
/// left: a test sees what each failure leaves behind.
fn shall_fail() -> bool {
    static WHICH: LazyLock<Option<usize>> =
        LazyLock::new(|| std::env::var("ISOLUME_FAIL_ALLOCATION").ok()?.parse().ok());
    static COUNT: AtomicUsize = AtomicUsize::new(0);
    *WHICH == Some(COUNT.fetch_add(1, Ordering::Relaxed))
}
