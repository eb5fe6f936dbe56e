//! Isolume renders scientific and medical volumes: a participating medium under global
//! illumination, with sharp isosurfaces inside it.
//!
//! From top to bottom: [`cli`] is what the user typed, [`view`] the window and [`job`] every other command,
//! [`scene`] is what is rendered, [`render`] how, [`gpu`] the only place that talks to Vulkan, and
//! [`output`] what is left behind. [`compare`] judges pictures.

pub mod cli;
pub mod compare;
pub mod engine;
pub mod error;
pub mod gpu;
pub mod info;
pub mod job;
pub mod output;
pub mod render;
pub mod scene;
pub mod view;
