//! The only module that talks to Vulkan, and the only one with `unsafe`. It knows nothing of volumes: it offers a
//! device, memory within a budget, images, buffers, shaders, passes and a frame, whose [`Recording`] takes the commands.
//!
//! Ownership is RAII throughout: a handle is null until it is filled, and `Drop` accepts null, so that every `?` on
//! the way cleans up. What is recorded is borrowed until the device has finished with it (`recording.rs`), and the host
//! never sees memory that the device may change meanwhile (`buffer.rs`). Images live in the GENERAL layout from their first
//! use, and barriers are global: there is one between any two passes.

mod bindings;
mod buffer;
mod compiled;
mod dead_branches;
mod descriptors;
mod device;
mod dispatch;
mod failure;
mod frame;
mod image;
mod instance;
mod memory;
mod needs;
mod pass;
mod pipeline;
mod pipeline_cache;
mod queue;
mod recording;
mod reflection;
mod shader;
mod shared;
mod slices;
mod spirv;
mod survey;
mod timing;
mod transfer;
#[cfg(feature = "window")]
mod window;

pub use buffer::{Buffer, BufferDesc, Placement};
pub use device::{Device, DeviceChoice};
pub use dispatch::Dispatch;
pub use frame::Frame;
pub use image::{Image, ImageDesc};
pub use instance::Validation;
pub use memory::{Memory, ResourceBytes};
pub use needs::Need;
pub use pass::{Binding, Pass};
pub use recording::Recording;
pub use shader::{PassDesc, Shaders};
pub use shared::{Shared, Specialization, Word, types};
pub use slices::{SLICE_MS, Slices};
pub use survey::{DeviceKind, DeviceSummary, list_devices};
pub use timing::{PassTotal, Span, Timings, Work};
pub use transfer::Piece;
#[cfg(feature = "window")]
pub use window::{
    ATLAS_SIDE, Canvas, CanvasMesh, CanvasVertex, SLOT_SIDE, SLOTS, Shape, Surface, Swapchain,
    Target, slot_corner,
};

pub use ash::vk::Format;
