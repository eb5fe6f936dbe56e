//! What holds of any volume that loads, whatever its file says.

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
