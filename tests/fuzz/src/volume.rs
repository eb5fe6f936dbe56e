//! Volumes: every format's target loads one and looks at it.

use std::path::Path;

use isolume::scene::volume::{Region, Volume, VolumeOverrides, Voxels};

use crate::guard;

/// Bytes that may be asked for, not just those held at once, to load a file of so many and to look at its voxels: buffers and
/// the state of decompression, and a multiple of the file for its header's text and its voxels.
pub fn allowed(file: usize) -> usize {
    (8 << 20) + 16 * file
}

/// The same of formats whose parts are decoded alone: a piece of the scan and the state of decompression, and what parts may
/// decode to. A codec makes at most so many bytes of one (as the constant in `source/codec` says), and what it makes is kept,
/// converted and placed.
pub fn allowed_in_chunks(file: usize) -> usize {
    const LARGEST_RATIO: usize = 32 << 10;
    (48 << 20) + 4 * LARGEST_RATIO * file
}

/// What the first byte of an input says of it, and the rest.
pub fn options(bytes: &[u8]) -> Option<(u8, VolumeOverrides, &[u8])> {
    let (&options, rest) = bytes.split_first()?;
    let overrides = VolumeOverrides {
        crop: (options & 1 != 0).then_some([[0; 3], [2; 3]]),
        spacing: (options & 2 != 0).then_some([1.0; 3]),
        axes: (options & 4 != 0).then(|| "LPS".parse().expect("axes")),
        ..Default::default()
    };
    Some((options >> 3, overrides, rest))
}

/// Loads a volume and its voxels; one that loads must be a proper one, and any part of it what it is of the whole.
pub fn check(path: &Path, overrides: &VolumeOverrides, allowed: usize) {
    let loaded = guard::run(allowed, || {
        let volume = Volume::load(path, overrides).ok()?;
        let voxels = volume.voxels().expect("its voxels").into_owned();
        Some((volume, voxels))
    });
    let Some((volume, voxels)) = loaded else {
        return;
    };
    assert_proper(&volume, voxels.len());
    let histogram = volume.histogram(16).expect("a histogram");
    assert_eq!(histogram.counts.iter().sum::<u64>() as usize, voxels.len());
    histogram.otsu();
    check_part(&volume, &voxels);
}

/// [`check`] for formats that need not store what is the same everywhere: a scan of such a volume is as long as it is.
/// Of one that is larger than its file could be, one voxel is read.
pub fn check_if_dense(path: &Path, overrides: &VolumeOverrides, allowed: usize) {
    /// Bytes that are asked for on the way of a voxel: of its chunk, of the scan, and of what is made of it.
    const BYTES_OF_A_VOXEL: u64 = 32;
    let one = VolumeOverrides {
        crop: Some([[0; 3], [1; 3]]),
        ..overrides.clone()
    };
    let opened = guard::run(allowed, || Volume::load(path, &one));
    let is_sparse = opened.is_ok_and(|volume| {
        let level = volume.storage.level.unwrap_or(0) as usize;
        let dims = volume.storage.levels[level].dims.map(u64::from);
        let voxels = dims.into_iter().fold(1, u64::saturating_mul);
        voxels.saturating_mul(BYTES_OF_A_VOXEL) > allowed as u64
    });
    if !is_sparse {
        check(path, overrides, allowed);
    }
}

/// What holds of any volume that loads, whatever its file says. `voxels` is the number of those that were read.
fn assert_proper(volume: &Volume, voxels: usize) {
    let count: usize = volume.dims.iter().map(|size| *size as usize).product();
    assert!(voxels > 0 && voxels == count);
    let is_length = |size: &f64| size.is_finite() && *size > 0.0;
    assert!(volume.spacing.iter().all(is_length));
    assert!(volume.scale > 0.0 && volume.scale.is_finite() && volume.offset.is_finite());
    assert!(volume.range[0] <= volume.range[1] && volume.range.iter().all(|v| v.is_finite()));
}

/// The middle third along each axis, read alone.
fn check_part(volume: &Volume, voxels: &Voxels) {
    let region = Region {
        low: volume.dims.map(|size| size / 3),
        dims: volume.dims.map(|size| size.div_ceil(3)),
    };
    let whole: &[u8] = match voxels {
        Voxels::U8(voxels) => voxels,
        Voxels::U16(voxels) => bytemuck::cast_slice(voxels),
        Voxels::F32(voxels) => bytemuck::cast_slice(voxels),
    };
    let size = volume.stored.bytes();
    let [width, height, depth] = region.dims.map(|size| size as usize);
    let mut part = vec![0; width * height * depth * size];
    volume.read(region, &mut part).expect("a part of it");
    let [x, y, z] = region.low.map(|low| low as usize);
    let [row, column, _] = volume.dims.map(|size| size as usize);
    for (n, found) in part.chunks_exact(width * size).enumerate() {
        let (j, k) = (y + n % height, z + n / height);
        let begin = ((k * column + j) * row + x) * size;
        assert!(
            found == &whole[begin..begin + width * size],
            "row {n} of a part"
        );
    }
}
