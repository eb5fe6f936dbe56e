//! Cases that break volume renderers, each under its own name.

mod closed_surfaces;
mod data;
mod depth;
mod many_surfaces;
mod march;
mod patches;
mod plateaus;
mod quadrature;
mod sides;
mod transfer;
