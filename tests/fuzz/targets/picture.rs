//! Pictures that `isolume compare` reads: OpenEXR and PNG.

#![no_main]

use isolume::compare::{LinearImage, compare_images};
use isolume_fuzz::{folder, guard, pictures, target};

/// Metrics of large pictures take long.
const MOST_MEASURED: usize = 1 << 12;

fn seeds() -> Vec<Vec<u8>> {
    let as_png = |bytes: Vec<u8>| [&[1], &bytes[..]].concat();
    let as_exr = |bytes: Vec<u8>| [&[0], &bytes[..]].concat();
    let exr = pictures::exr().into_iter().map(as_exr);
    exr.chain(pictures::png().into_iter().map(as_png)).collect()
}

fn parse(bytes: &[u8]) {
    let Some((&options, bytes)) = bytes.split_first() else {
        return;
    };
    let path = folder::write(["p.exr", "p.png"][usize::from(options & 1)], bytes);
    let read = guard::run(pictures::allowed(bytes.len()), || LinearImage::read(&path));
    let Ok(picture) = read else {
        return;
    };
    assert_eq!(picture.rgb.len(), picture.width * picture.height);
    if picture.rgb.len() <= MOST_MEASURED
        && let Ok(comparison) = compare_images(&picture, &picture, 0.0)
    {
        assert_eq!(comparison.mse, 0.0);
    }
}

target!(seeds, parse);
