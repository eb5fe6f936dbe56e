//! The `caching` variant: it shows what `non-caching` shows, and loses no more than is stated here.
//!
//! `cargo test --test caching -- --nocapture` prints the figures.

#[path = "../common/mod.rs"]
mod common;

mod accumulation;
mod agreement;
mod closed_form;
mod focus;
mod gathering;
mod lifetime;
mod surfaces;
mod texels;
