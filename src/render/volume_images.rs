//! The images that hold the volume: one, unless the memory has room for more bricks than one allocation. Drivers allocate at
//! most 2 or 4 GiB at once, and a device may have 80.
//!
//! A shader cannot choose an image by an index that differs from invocation to invocation where a device lacks that, as CPUs'
//! drivers do. So each image has a name of its own, and a macro that is written here repeats what reads it.

/// Their names, both of the resources and in shaders. There are no more.
pub const VOLUME_IMAGES: [&str; 16] = [
    "volume",
    "volume_2",
    "volume_3",
    "volume_4",
    "volume_5",
    "volume_6",
    "volume_7",
    "volume_8",
    "volume_9",
    "volume_10",
    "volume_11",
    "volume_12",
    "volume_13",
    "volume_14",
    "volume_15",
    "volume_16",
];

/// The text of a macro that takes another one, `DO`, and repeats it for each of so many images: with the image's name, and
/// with the condition that the shader's variable `image` is its number.
pub fn each_volume_image(count: u32) -> String {
    if count <= 1 {
        return format!("DO({}, true)", VOLUME_IMAGES[0]);
    }
    let names = VOLUME_IMAGES.iter().zip(0..count);
    let each = names.map(|(name, n)| format!("DO({name}, image == {n}) "));
    each.collect()
}
