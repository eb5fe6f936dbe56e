//! Copies between host memory and images, through the one staging buffer, in whole rows.

use crate::error::Result;
use crate::gpu::{Buffer, Frame, Image};

/// A `Sink` takes the next bytes, a `Source` fills the next bytes.
pub type Sink<'a> = dyn FnMut(&[u8]) -> Result<()> + 'a;
pub type Source<'a> = dyn FnMut(&mut [u8]) -> Result<()> + 'a;

/// Fills an image with texels in x, y, z order.
pub fn upload(frame: &mut Frame, staging: &mut Buffer, image: &Image, texels: &[u8]) -> Result<()> {
    upload_corner(frame, staging, image, image.desc().extent, texels)
}

/// Fills the picture of that size in an image's upper left corner, row 0 on top.
pub fn upload_picture(
    frame: &mut Frame,
    staging: &mut Buffer,
    image: &Image,
    [width, height]: [u32; 2],
    texels: &[[f32; 4]],
) -> Result<()> {
    let texels = bytemuck::cast_slice(texels);
    upload_corner(frame, staging, image, [width, height, 1], texels)
}

/// Fills the box of size `extent` at an image's lowest corner with texels in x, y, z order.
fn upload_corner(
    frame: &mut Frame,
    staging: &mut Buffer,
    image: &Image,
    extent: [u32; 3],
    texels: &[u8],
) -> Result<()> {
    let mut rest = texels;
    upload_pieces(frame, staging, image, extent, &mut |to| {
        let (piece, remaining) = rest.split_at(to.len());
        to.copy_from_slice(piece);
        rest = remaining;
        Ok(())
    })
}

/// Fills the box of size `extent` at an image's lowest corner with texels that come in x, y, z order.
pub fn upload_pieces(
    frame: &mut Frame,
    staging: &mut Buffer,
    image: &Image,
    extent: [u32; 3],
    source: &mut Source<'_>,
) -> Result<()> {
    let texel = image.desc().texel_bytes();
    for (low, extent) in pieces(extent, texel, staging.desc().bytes) {
        let bytes = extent.iter().product::<u32>() as usize * texel;
        if let Some(mapped) = staging.mapped_mut() {
            source(&mut mapped[..bytes])?;
        }
        frame.run(|recording| recording.upload(staging, image, low, extent))?;
    }
    Ok(())
}

/// Passes the bytes of the box of size `extent` at an image's lowest corner to `sink`, in x, y, z order.
pub fn download_pieces(
    frame: &mut Frame,
    staging: &mut Buffer,
    image: &Image,
    extent: [u32; 3],
    sink: &mut Sink<'_>,
) -> Result<()> {
    let texel = image.desc().texel_bytes();
    for (low, extent) in pieces(extent, texel, staging.desc().bytes) {
        frame.run(|recording| recording.download(image, staging, low, extent))?;
        let bytes = extent.iter().product::<u32>() as usize * texel;
        sink(&staging.mapped_mut().unwrap_or_default()[..bytes])?;
    }
    Ok(())
}

/// The picture of that size in an image's upper left corner, row 0 on top.
pub fn download_picture(
    frame: &mut Frame,
    staging: &Buffer,
    image: &Image,
    [width, height]: [u32; 2],
) -> Result<Vec<[f32; 4]>> {
    let mut all = vec![[0.0; 4]; width as usize * height as usize];
    let (mut rest, texel) = (&mut all[..], image.desc().texel_bytes());
    for (low, extent) in pieces([width, height, 1], texel, staging.desc().bytes) {
        frame.run(|recording| recording.download(image, staging, low, extent))?;
        let texels = extent.iter().product::<u32>() as usize;
        let piece = rest.split_off_mut(..texels);
        staging.read_into(piece.expect("pieces cover the picture"));
    }
    Ok(all)
}

/// Boxes of whole rows or whole slices that cover `extent` in order, each at most `most_bytes`.
fn pieces(extent: [u32; 3], texel_bytes: usize, most_bytes: u64) -> Vec<([u32; 3], [u32; 3])> {
    let [width, height, depth] = extent;
    let row = width as u64 * texel_bytes as u64;
    let rows = (most_bytes / row) as u32;
    let mut pieces = Vec::new();
    if rows >= height {
        let slices = rows / height;
        for z in (0..depth).step_by(slices as usize) {
            pieces.push(([0, 0, z], [width, height, slices.min(depth - z)]));
        }
        return pieces;
    }
    for z in 0..depth {
        for y in (0..height).step_by(rows as usize) {
            pieces.push(([0, y, z], [width, rows.min(height - y), 1]));
        }
    }
    pieces
}
