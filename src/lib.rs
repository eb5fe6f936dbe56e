//! Isolume renders scientific and medical volumes: a participating medium under global illumination, with sharp
//! isosurfaces inside it, on Vulkan. It decides every byte of GPU memory itself and says in advance how many it takes.
//!
//! A program drives it through one type, the [`Engine`]:
//!
//! ```
//! use isolume::scene::volume::{Volume, Voxels};
//! use isolume::scene::{SceneFile, resolve};
//! use isolume::{Engine, Host, HostOptions, Result, Stop};
//! use std::num::NonZeroU32;
//!
//! fn main() -> Result<()> {
//!     let ball = |i: usize| 8.0 - [i % 16, i / 16 % 16, i / 256].map(|n| n as f32 - 7.5).iter().map(|x| x * x).sum::<f32>().sqrt();
//!     let volume = Volume::from_values([16; 3], [1.0; 3], Voxels::F32((0..4096).map(ball).collect()))?;
//!     let text = "medium.transfer = [{ value = 0.0, opacity = 0.0 }, { value = 8.0 }]\nrender.size = [64, 64]";
//!     let file = SceneFile::parse(text, "ball.toml".as_ref(), &[])?;
//!     let (scene, _notes) = resolve(&file, &volume)?;
//!     let host = Host::open(&HostOptions::default())?;
//!     println!("{} bytes", host.plan(&volume, &scene)?.plan.bytes());
//!     let mut engine = Engine::new(&host, &volume, &scene, 0)?;
//!     engine.render(Stop::at_samples(NonZeroU32::new(16).unwrap()))?;
//!     let picture = engine.picture()?;
//!     assert_eq!(picture.rgb.len(), 64 * 64);
//!     Ok(())
//! }
//! ```
//!
//! [`scene::open`] opens a file instead: a scene in TOML, or a bare volume and a preset. [`output::write_exr`] and
//! [`output::write_png`] keep the picture, [`compare`] judges it, and [`shard`] puts one together that several machines have
//! rendered.
//!
//! From top to bottom: `cli` is what the user typed, `view` the window and `job` every other command; both sit on
//! [`engine`]; [`scene`] is what is rendered, [`render`] how, and [`gpu`] the only place that talks to Vulkan. The
//! feature `cli` brings the command line and `window` the window; a program that embeds the engine needs neither.

#![deny(unsafe_code)]

mod bytes;
pub mod cache_dir;
#[cfg(feature = "cli")]
pub mod cli;
pub mod compare;
mod decoding;
#[cfg(feature = "cli")]
pub mod doctor;
pub mod engine;
pub mod error;
#[allow(unsafe_code)]
#[deny(clippy::undocumented_unsafe_blocks)]
pub mod gpu;
#[cfg(feature = "cli")]
pub mod interrupt;
#[cfg(feature = "cli")]
pub mod job;
mod locked;
pub mod output;
pub mod panic_guard;
mod regular_file;
pub mod render;
pub mod scene;
pub mod shard;
mod srgb;
mod temporary;
#[cfg(feature = "window")]
pub mod view;

pub use engine::{Changed, Engine, Host, HostOptions, Limit, Outcome, Picture, Stop};
pub use error::{Error, Result};
