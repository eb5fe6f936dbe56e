//! Passes whose work no picture of another test would miss, each by itself: what it reads, and what it writes.

mod cut_cubes;
mod dead_branches;
mod marched;
pub mod tone_map;
