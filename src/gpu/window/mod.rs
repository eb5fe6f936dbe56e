//! The parts of a device that only a window needs: its images, and drawing a user interface into them.

mod canvas;
mod surface;
mod swapchain;
mod target;

pub use canvas::{ATLAS_SIDE, Canvas, CanvasMesh, CanvasVertex, SLOT_SIDE, SLOTS, slot_corner};
pub use surface::{Shape, Surface};
pub use swapchain::Swapchain;
pub use target::Target;
