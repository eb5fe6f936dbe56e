//! The parts of a scene that are images, on their way onto the GPU: voxels, the macrocells' ranges, transfer function
//! and sky.

use super::copy;
use super::gpu_scene::GpuScene;
use super::resources::Resources;
use crate::error::Result;
use crate::gpu::Frame;
use crate::scene::volume::Volume;

/// Writes all of a scene for the first time.
pub fn load(frame: &mut Frame, r: &mut Resources, volume: &Volume, scene: &GpuScene) -> Result<()> {
    match &mut r.bricks {
        Some(bricks) => bricks.open(frame, volume, scene)?,
        None => upload_voxels(frame, r, volume)?,
    }
    let ranges = bytemuck::cast_slice(volume.macrocell_ranges());
    copy::upload(frame, &mut r.staging, &r.ranges, ranges)?;
    upload_transfer(frame, r, scene)?;
    if let Some(sky) = &scene.parts.lights.sky_image {
        let texels = sky.image.texels.iter();
        let texels: Vec<[f32; 4]> = texels.map(|&[r, g, b]| [r, g, b, 1.0]).collect();
        let texels = bytemuck::cast_slice(&texels);
        copy::upload(frame, &mut r.staging, &r.lights.environment, texels)?;
    }
    Ok(())
}

/// Takes the voxels piece by piece from the volume's source into the staging buffer: they are never in memory all at
/// once.
fn upload_voxels(frame: &mut Frame, r: &mut Resources, volume: &Volume) -> Result<()> {
    let mut reader = volume.reader();
    let image = &r.volumes[0];
    for piece in volume.pieces(r.staging.desc().bytes) {
        let bytes = piece.voxels() * volume.stored.bytes();
        if let Some(staging) = r.staging.mapped_mut() {
            reader.read(piece, &mut staging[..bytes])?;
        }
        frame.run(|recording| recording.upload(&r.staging, image, piece.low, piece.dims))?;
    }
    Ok(())
}

pub fn upload_transfer(frame: &mut Frame, r: &mut Resources, scene: &GpuScene) -> Result<()> {
    let texels = scene.parts.medium.transfer_texels();
    if texels.is_empty() {
        return Ok(());
    }
    if r.transfer.desc().bytes() != size_of_val(&texels[..]) as u64 {
        r.resize_transfer(scene.parts.medium.transfer.len())?;
    }
    let texels = bytemuck::cast_slice(&texels);
    copy::upload(frame, &mut r.staging, &r.transfer, texels)
}
