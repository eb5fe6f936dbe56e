//! What is written: pictures, statistics, traces, progress; and that nothing is written by halves.

mod files;
mod pictures;
mod progress;
mod statistics;

use isolume::engine::Picture;

/// One row of pixels.
fn row(rgb: &[[f32; 3]], alpha: Option<&[f32]>) -> Picture {
    let layer = |offset: f32| rgb.iter().map(|p| p.map(|v| v + offset)).collect();
    Picture {
        width: rgb.len() as u32,
        height: 1,
        rgb: rgb.to_vec(),
        alpha: alpha.map(<[f32]>::to_vec),
        stderr: layer(10.0),
        albedo: layer(20.0),
        normal: layer(30.0),
        depth: (0..rgb.len())
            .map(|i| [f32::INFINITY, 1.5][i % 2])
            .collect(),
    }
}
