//! The `caching` variant: it shows what `non-caching` shows, and loses no more than is stated here.
//!
//! `cargo test --test transport caching -- --nocapture` prints the figures.

mod accumulation;
mod agreement;
mod anisotropy;
mod closed_form;
mod focus;
mod gathering;
mod lifetime;
mod reflection;
mod rim;
mod standard_error;
mod surfaces;
mod texels;
mod thick_slices;
mod thin_layers;
