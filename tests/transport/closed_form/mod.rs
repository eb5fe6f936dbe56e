//! Radiance that is known exactly. A patch's mean must lie within four standard errors and 2e-4 of
//! it; a standard error above one in a thousand, and above 2e-4, decides nothing and fails.

mod attenuation;
mod background;
mod furnace;
mod slabs;
mod spheres;
