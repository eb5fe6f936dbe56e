//! Cases that break volume renderers, each under its own name.

#[path = "../common/mod.rs"]
mod common;

mod data;
mod depth;
mod patches;
mod quadrature;
mod rays;
mod transfer;
