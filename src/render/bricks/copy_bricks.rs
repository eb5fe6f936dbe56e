//! Bricks on their way from the staging buffer to their places in the volume's image: on a GPU by a pass, since copies
//! of small boxes take its driver long (`glsl/copy_bricks.comp`), and otherwise by a copy command.

use std::sync::Arc;

use crate::error::Result;
use crate::gpu::types::*;
use crate::gpu::{Binding, Buffer, BufferDesc, Frame, Image, Memory, Pass, Piece, Work};
use crate::render::pass_compiler::PassCompiler;
use crate::render::shared::BrickPiece;
use crate::shared;

shared! {
    pub struct CopyPush {
        /// 1, 2 or 4.
        pub voxel_bytes: uint,
    }
}

pub struct CopyBricks {
    /// The pieces that the pass copies at once; `None` where a copy command does it.
    pieces: Option<Buffer>,
    /// `None` until it is compiled, and where a copy command does it.
    pass: Option<Pass>,
}

impl CopyBricks {
    /// Room for `most` bricks at once.
    pub fn allocate(memory: &Arc<Memory>, most: usize) -> Result<CopyBricks> {
        let desc = BufferDesc::upload("brick pieces", (most * size_of::<BrickPiece>()) as u64);
        let pieces = is_by_pass(memory).then(|| Buffer::new(memory, desc));
        Ok(CopyBricks {
            pieces: pieces.transpose()?,
            pass: None,
        })
    }

    pub fn compile(&mut self, passes: &PassCompiler<'_>) -> Result<()> {
        if self.pieces.is_some() {
            self.pass = Some(passes.compile::<CopyPush>("copy_bricks")?);
        }
        Ok(())
    }

    /// Writes the pieces of `staging` into `image`.
    pub fn run(
        &self,
        frame: &mut Frame,
        staging: &Buffer,
        image: &Image,
        pieces: &[Piece],
    ) -> Result<()> {
        let (Some(pass), Some(buffer)) = (&self.pass, &self.pieces) else {
            return frame.run(|recording| recording.upload_pieces(staging, image, pieces));
        };
        let piece = |piece: &Piece| BrickPiece {
            offset: piece.offset as u32,
            low: piece.low,
            extent: piece.extent,
        };
        buffer.write(&pieces.iter().map(piece).collect::<Vec<_>>());
        let texels = |piece: &Piece| piece.extent.iter().product::<u32>();
        let push = CopyPush {
            voxel_bytes: image.desc().texel_bytes() as u32,
        };
        let bindings = [
            ("staging", Binding::Buffer(staging)),
            ("pieces", Binding::Buffer(buffer)),
            ("volume", Binding::Image(image)),
        ];
        let most = pieces.iter().map(texels).max().unwrap_or(0);
        let all: u64 = pieces.iter().map(|p| u64::from(texels(p))).sum();
        frame.run(|recording| {
            recording.dispatch(pass, &bindings, &push, [most, pieces.len() as u32, 1])?;
            recording.state_work(Work::copy(all * u64::from(push.voxel_bytes)));
            Ok(())
        })
    }
}

/// Whether a pass copies bricks into the image, and not a copy command.
pub fn is_by_pass(memory: &Memory) -> bool {
    let device = memory.device();
    device.stores_texels && !device.loads_texels
}
