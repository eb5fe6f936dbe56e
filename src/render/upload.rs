//! What of a scene is an image: voxels, the macrocells' ranges, transfer function, sky and the cache's
//! pages, on their way onto the GPU.

use std::sync::Arc;

use super::constants::SceneBuffers;
use super::copy;
use super::resources::Resources;
use crate::error::Result;
use crate::gpu::{Frame, Memory};
use crate::scene::volume::Volume;

/// All of a scene, on its way onto the GPU for the first time.
pub fn load(
    memory: &Arc<Memory>,
    volume: &Volume,
    scene: &SceneBuffers,
) -> Result<(Frame, Resources)> {
    let mut frame = Frame::new(memory.device())?;
    let mut resources = Resources::allocate(memory, volume, scene)?;
    let (f, r) = (&mut frame, &mut resources);
    f.run(|f| {
        f.adopt(&r.images_to_fill())?;
        f.clear(&r.images_from_zero())
    })?;
    upload_voxels(f, r, volume)?;
    let ranges = bytemuck::cast_slice(volume.macrocell_ranges());
    copy::upload(f, &mut r.staging, &r.ranges, ranges)?;
    upload_transfer(f, r, scene)?;
    let texels = scene.environment.texels.iter();
    let texels: Vec<[f32; 4]> = texels.map(|&[r, g, b]| [r, g, b, 1.0]).collect();
    let texels = bytemuck::cast_slice(&texels);
    copy::upload(f, &mut r.staging, &r.environment, texels)?;
    upload_pages(f, r, scene)?;
    Ok((frame, resources))
}

/// Piece by piece from the volume's source into the staging buffer: its voxels are never in memory all
/// at once.
fn upload_voxels(frame: &mut Frame, r: &mut Resources, volume: &Volume) -> Result<()> {
    let mut reader = volume.reader();
    for piece in volume.pieces(r.staging.desc.bytes) {
        let bytes = piece.voxels() * volume.stored.bytes();
        if let Some(staging) = r.staging.mapped_mut() {
            reader.read(piece, &mut staging[..bytes])?;
        }
        frame.run(|f| f.upload(&r.staging, &r.volume, piece.low, piece.dims))?;
    }
    Ok(())
}

pub fn upload_transfer(frame: &mut Frame, r: &mut Resources, scene: &SceneBuffers) -> Result<()> {
    let texels = scene.transfer_texels();
    if texels.is_empty() {
        return Ok(());
    }
    if r.transfer.desc.bytes() != size_of_val(&texels[..]) as u64 {
        r.resize_transfer(scene.transfer.len())?;
        frame.run(|f| f.adopt(&[&r.transfer]))?;
    }
    let texels = bytemuck::cast_slice(&texels);
    copy::upload(frame, &mut r.staging, &r.transfer, texels)
}

pub fn upload_pages(frame: &mut Frame, r: &mut Resources, scene: &SceneBuffers) -> Result<()> {
    match (&r.cache, &scene.cache) {
        (Some(cache), Some(layout)) => {
            let pages = layout.pages();
            let texels = bytemuck::cast_slice(&pages);
            copy::upload(frame, &mut r.staging, &cache.pages, texels)
        }
        _ => Ok(()),
    }
}
