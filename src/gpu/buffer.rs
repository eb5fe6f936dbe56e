//! Buffers: on the device, or mapped for the host to write or read.
//!
//! **Why mapped memory is never seen while the device changes it.** The device uses a buffer only inside of [`Frame::run`],
//! for which the buffer is borrowed (`recording.rs`). References into mapped memory are only handed out for a buffer that is
//! borrowed exclusively, so none exists then. What a shared buffer offers is copies into it and out of it, as [`Cell`] does.
//! They cannot meet the device's work either: from the submission on, `run` blocks its thread until the device has finished,
//! and like a [`Cell`], a buffer is not [`Sync`], so that no other thread has it. All mapped memory is coherent.
//!
//! [`Frame::run`]: super::Frame::run

use std::cell::Cell;
use std::marker::PhantomData;
use std::ptr;
use std::sync::Arc;

use ash::vk;
use gpu_allocator::MemoryLocation;

use super::failure::failure;
use super::memory::{Holding, Memory, Owner};
use crate::error::{MemoryError, Result};

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct BufferDesc {
    pub name: &'static str,
    pub bytes: u64,
    pub placement: Placement,
}

impl BufferDesc {
    pub const fn device(name: &'static str, bytes: u64) -> BufferDesc {
        BufferDesc::new(name, bytes, Placement::Device)
    }

    pub const fn upload(name: &'static str, bytes: u64) -> BufferDesc {
        BufferDesc::new(name, bytes, Placement::Upload)
    }

    pub const fn host_cached(name: &'static str, bytes: u64) -> BufferDesc {
        BufferDesc::new(name, bytes, Placement::HostCached)
    }

    const fn new(name: &'static str, bytes: u64, placement: Placement) -> BufferDesc {
        BufferDesc {
            name,
            bytes,
            placement,
        }
    }
}

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Placement {
    Device,
    /// The host writes and the device reads. It lies in the device's memory if the host can write to that; on a GPU, reading
    /// from there takes the host very long.
    Upload,
    /// In the host's memory, and in its caches if the device has such memory. Both sides read and write; a GPU does so over the
    /// bus.
    HostCached,
}

pub struct Buffer {
    raw: vk::Buffer,
    pub(super) desc: BufferDesc,
    not_sync: PhantomData<Cell<u8>>,
    // Last: the memory goes after the buffer.
    holding: Holding,
}

impl Buffer {
    /// Makes a buffer. An empty one still gets 16 bytes, since Vulkan has no empty buffers.
    pub fn new(memory: &Arc<Memory>, mut desc: BufferDesc) -> Result<Buffer> {
        desc.bytes = desc.bytes.max(16);
        let limits = &memory.limits;
        if desc.bytes > limits.max_storage_buffer_bytes {
            return Err(MemoryError::Buffer {
                resource: desc.name.into(),
                bytes: desc.bytes,
                device: limits.name.clone(),
                limit: limits.max_storage_buffer_bytes,
            }
            .into());
        }
        let device = &memory.device;
        let info = vk::BufferCreateInfo::default().size(desc.bytes).usage(
            vk::BufferUsageFlags::STORAGE_BUFFER
                | vk::BufferUsageFlags::TRANSFER_SRC
                | vk::BufferUsageFlags::TRANSFER_DST,
        );
        let query = vk::DeviceBufferMemoryRequirements::default().create_info(&info);
        let mut requirements = vk::MemoryRequirements2::default();
        // SAFETY: the query describes a valid buffer; nothing is created.
        unsafe {
            device
                .raw
                .get_device_buffer_memory_requirements(&query, &mut requirements)
        };
        let requirements = requirements.memory_requirements;
        let mut buffer = Buffer {
            raw: vk::Buffer::null(),
            desc,
            not_sync: PhantomData,
            holding: memory.reserve(desc.name, &requirements)?,
        };
        if memory.is_dry_run() {
            return Ok(buffer);
        }
        let failed = |e: vk::Result| failure(e, format!("buffer {} could not be made", desc.name));
        // SAFETY: `info` is valid; the buffer is destroyed in Drop.
        buffer.raw = unsafe { device.raw.create_buffer(&info, None) }.map_err(failed)?;
        let location = match desc.placement {
            Placement::Device => MemoryLocation::GpuOnly,
            Placement::Upload => MemoryLocation::CpuToGpu,
            Placement::HostCached => MemoryLocation::GpuToCpu,
        };
        let owner = Owner::Buffer(buffer.raw);
        let allocation = buffer.holding.allocate(requirements, location, owner)?;
        // SAFETY: the allocation is dedicated to this buffer and lives as long as it.
        unsafe {
            device
                .raw
                .bind_buffer_memory(buffer.raw, allocation.memory(), allocation.offset())
        }
        .map_err(failed)?;
        Ok(buffer)
    }

    /// The handle for a command. A buffer without memory, since a dry run has made it or it could not be resized, has none.
    pub(super) fn handle(&self) -> vk::Buffer {
        let name = self.desc.name;
        assert!(self.raw != vk::Buffer::null(), "{name} has no memory");
        self.raw
    }

    /// A mapped buffer that holds `data`; an empty one has room for an element, since shaders may read one, although
    /// they do not use it.
    pub fn with_data<T: bytemuck::NoUninit>(
        memory: &Arc<Memory>,
        name: &'static str,
        data: &[T],
    ) -> Result<Buffer> {
        Buffer::with_data_in(memory, name, Placement::Upload, data)
    }

    /// A buffer that holds `data` where `placement` says, which must be mapped.
    pub fn with_data_in<T: bytemuck::NoUninit>(
        memory: &Arc<Memory>,
        name: &'static str,
        placement: Placement,
        data: &[T],
    ) -> Result<Buffer> {
        let desc = BufferDesc {
            name,
            bytes: bytes_for(data),
            placement,
        };
        let buffer = Buffer::new(memory, desc)?;
        buffer.write(data);
        Ok(buffer)
    }

    pub fn desc(&self) -> &BufferDesc {
        &self.desc
    }

    /// Changes the size; the contents are lost. The old memory is freed first, so that both together are never
    /// needed: after an error the buffer has no bytes, and may only be resized or dropped.
    pub fn resize(&mut self, bytes: u64) -> Result<()> {
        let desc = BufferDesc { bytes, ..self.desc };
        if bytes.max(16) != self.desc.bytes {
            let memory = self.holding.memory();
            self.destroy();
            *self = Buffer::new(&memory, desc)?;
        }
        Ok(())
    }

    fn destroy(&mut self) {
        // SAFETY: a recording borrows the buffer until its work has ended, so nothing uses it.
        unsafe { self.holding.device().raw.destroy_buffer(self.raw, None) };
        self.raw = vk::Buffer::null();
        self.desc.bytes = 0;
        self.holding.release();
    }

    /// Writes `data`, and changes the buffer's size to that of `data`.
    pub fn rewrite<T: bytemuck::NoUninit>(&mut self, data: &[T]) -> Result<()> {
        self.resize(bytes_for(data))?;
        self.write(data);
        Ok(())
    }

    /// Writes from the buffer's start. While a frame is recorded, that is before all of its commands. Does nothing in a dry
    /// run.
    pub fn write<T: bytemuck::NoUninit>(&self, data: &[T]) {
        let bytes: &[u8] = bytemuck::cast_slice(data);
        if let Some(mapped) = self.mapped(bytes.len()) {
            // SAFETY: so many bytes are mapped. Nothing else accesses them now: the module says why.
            unsafe { ptr::copy_nonoverlapping(bytes.as_ptr(), mapped, bytes.len()) };
        }
    }

    /// Reads from the buffer's start as much as `data` has room for. Does nothing in a dry run.
    pub fn read_into<T: bytemuck::Pod>(&self, data: &mut [T]) {
        let bytes: &mut [u8] = bytemuck::cast_slice_mut(data);
        if let Some(mapped) = self.mapped(bytes.len()) {
            // SAFETY: so many bytes are mapped. Nothing else accesses them now: the module says why.
            unsafe { ptr::copy_nonoverlapping(mapped, bytes.as_mut_ptr(), bytes.len()) };
        }
    }

    /// The value at the buffer's start; zeros in a dry run.
    pub fn read<T: bytemuck::Pod>(&self) -> T {
        let mut value = T::zeroed();
        self.read_into(std::slice::from_mut(&mut value));
        value
    }

    /// The first `count` values; zeros in a dry run.
    pub fn read_vec<T: bytemuck::Pod>(&self, count: usize) -> Vec<T> {
        let mut values = vec![T::zeroed(); count];
        self.read_into(&mut values);
        values
    }

    /// The mapped bytes, of which at least `needed` are there; `None` in a dry run. Panics if the buffer is on the device or
    /// is smaller.
    fn mapped(&self, needed: usize) -> Option<*mut u8> {
        let (name, bytes) = (self.holding.name(), self.desc.bytes);
        // Where all memory can be mapped, as on a CPU, this would be noticed on other devices only.
        assert!(
            self.desc.placement != Placement::Device,
            "{name} is on the device"
        );
        let allocation = self.holding.allocation()?;
        let mapped = allocation.mapped_ptr();
        let mapped = mapped.unwrap_or_else(|| panic!("{name} is not mapped"));
        assert!(needed as u64 <= bytes, "{name} has only {bytes} bytes");
        Some(mapped.as_ptr().cast())
    }

    /// The mapped bytes; `None` in a dry run. Panics if the buffer is on the device.
    pub fn mapped_mut(&mut self) -> Option<&mut [u8]> {
        let bytes = self.desc.bytes as usize;
        let mapped = self.mapped(bytes)?;
        // SAFETY: so many bytes are mapped, as long as the buffer is not resized, for which it would have to be borrowed again.
        // Nothing else accesses them meanwhile: the module says why.
        Some(unsafe { std::slice::from_raw_parts_mut(mapped, bytes) })
    }
}

fn bytes_for<T>(data: &[T]) -> u64 {
    size_of_val(data).max(size_of::<T>()) as u64
}

impl Drop for Buffer {
    fn drop(&mut self) {
        self.destroy();
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::gpu::{Device, DeviceChoice, Format, Frame, Image, ImageDesc};

    /// A later resize to the old size must not take what is gone for what is there.
    #[test]
    fn what_could_not_be_resized_has_no_size() {
        let device = Device::open(&DeviceChoice::default()).expect("a Vulkan device");
        let memory = Memory::new(&device, 1 << 20).expect("memory");
        let desc = BufferDesc::upload("numbers", 4096);
        let mut buffer = Buffer::new(&memory, desc).expect("a buffer");
        assert!(buffer.resize(2 << 20).is_err());
        assert_eq!((buffer.desc.bytes, memory.used()), (0, 0));
        buffer.resize(4096).expect("a buffer");
        assert_eq!(buffer.mapped_mut().map(|mapped| mapped.len()), Some(4096));
        buffer.resize(16).expect("a buffer");
        let desc = ImageDesc::flat("texels", [16, 16], Format::R8G8B8A8_UNORM).zeroed();
        let mut image = Image::new(&memory, desc).expect("an image");
        assert!(image.resize([1024, 1024, 1]).is_err());
        assert_eq!(image.desc.extent, [0; 3]);
        image.resize(desc.extent).expect("an image");
        assert_eq!(image.desc, desc);
    }

    #[test]
    #[should_panic(expected = "numbers has no memory")]
    fn what_a_dry_run_has_made_cannot_be_used() {
        let device = Device::open(&DeviceChoice::default()).expect("a Vulkan device");
        let memory = Memory::dry_run(&device, device.summary.clone());
        let buffer = Buffer::new(&memory, BufferDesc::device("numbers", 4096)).expect("a plan");
        let mut frame = Frame::new(&device).expect("a frame");
        let _ = frame.run(|recording| recording.zero(&buffer));
    }
}
