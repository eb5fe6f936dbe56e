//! What holds of any volume that loads, whatever its file says, and how much memory may be asked for to load one.

use isolume::scene::volume::Volume;

/// `voxels` is the number of those that were read.
pub fn assert_proper(volume: &Volume, voxels: usize) {
    let count: usize = volume.dims.iter().map(|size| *size as usize).product();
    assert!(voxels > 0 && voxels == count);
    assert!(
        volume
            .spacing
            .iter()
            .all(|size| size.is_finite() && *size > 0.0)
    );
    assert!(volume.scale > 0.0 && volume.scale.is_finite() && volume.offset.is_finite());
    assert!(volume.range[0] <= volume.range[1] && volume.range.iter().all(|v| v.is_finite()));
}

/// All bytes that may be asked for, not just those held at once: `fixed` for buffers and the state of decompression, and a
/// multiple of the file for its header's text and its voxels.
pub fn allowance(fixed: usize, file: usize) -> usize {
    fixed + 16 * file
}

/// The same of formats whose parts are decoded alone: a piece of the walk and the state of decompression, and what parts may
/// decode to. A codec makes at most so many bytes of one, and what it makes is kept, converted and placed.
pub fn allowance_in_chunks(file: usize) -> usize {
    const MAX_RATIO: usize = 32 << 10;
    (48 << 20) + 4 * MAX_RATIO * file
}
