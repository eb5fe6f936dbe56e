//! How far the device's own filter is off. `doctor` reports it.
//!
//! The field is *defined* as the trilinear interpolant, and filters differ from it: lavapipe interpolates 8-bit texels in
//! 8 bits, and GPUs round positions to 1/256 of a voxel. What a narrow transfer function makes of that can be seen: an H100
//! took 4 to 16 % of the light behind a tent whose width is a fiftieth of a voxel's step (`transport hard_cases`). And the
//! picture of a volume in bricks would be another than that of a whole one. So shaders interpolate between eight texels
//! everywhere. Only the variant `published` reads its cells through the filter, as its paper has it.

use std::sync::Arc;

use crate::error::Result;
use crate::gpu::{
    Binding, Buffer, BufferDesc, Device, Format, Frame, Image, ImageDesc, Memory, Pass, PassDesc,
    Shaders, Shared,
};
use crate::render::shared::PROBE_POSITIONS;

/// A budget that exceeds what the probe's few resources take.
const BUDGET: u64 = 16 << 20;

/// The largest error of the device's filter, as a share of the texels' difference; `None` if it has no filter for
/// this format.
pub fn filter_error(
    device: &Arc<Device>,
    shaders: &Shaders,
    format: Format,
) -> Result<Option<f32>> {
    if !device.filters(format) {
        return Ok(None);
    }
    let memory = Memory::new(device, BUDGET)?;
    let desc = ImageDesc::volumetric("filter probe", [2; 3], format);
    let image = Image::new(&memory, desc)?;
    let staging = match format {
        Format::R8_UNORM => Buffer::with_data(&memory, "checkerboard", &checkerboard(u8::MAX))?,
        Format::R16_UNORM => Buffer::with_data(&memory, "checkerboard", &checkerboard(u16::MAX))?,
        _ => Buffer::with_data(&memory, "checkerboard", &checkerboard(1.0f32))?,
    };
    let errors = Buffer::new(
        &memory,
        BufferDesc::host_cached("filter errors", PROBE_POSITIONS as u64 * 4),
    )?;
    let desc = PassDesc {
        name: "filter_probe",
        specialization: &[],
        push: <()>::PUSH,
        macros: &[],
    };
    let pass = Pass::new(device, shaders, &desc)?;
    let mut frame = Frame::new(device)?;
    frame.run(|recording| {
        recording.upload(&staging, &image, [0; 3], [2; 3])?;
        let bindings = [
            ("checkerboard", Binding::Filtered(&image)),
            ("errors", Binding::Buffer(&errors)),
        ];
        recording.dispatch(&pass, &bindings, &(), [PROBE_POSITIONS, 1, 1])
    })?;
    let measured = errors.read_vec::<f32>(PROBE_POSITIONS as usize);
    Ok(Some(measured.into_iter().fold(0.0, f32::max)))
}

fn checkerboard<T: Default + Copy>(high: T) -> [T; 8] {
    std::array::from_fn(|i| match (i ^ i >> 1 ^ i >> 2) & 1 {
        0 => T::default(),
        _ => high,
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::gpu::{DeviceChoice, Validation};
    use crate::render::shared;

    const SHADER: &str = include_str!("../../../glsl/filter_probe.comp");
    const FILTER: &str = "textureLod(checkerboard, (t + 0.5) / 2.0, 0.0).r";

    /// A filter that rounds the position between the two texels to `weight`, GLSL in terms of `exact`.
    fn with_weight(weight: &str) -> String {
        let texel = |at: &str| format!("texelFetch(checkerboard, {at}, 0).r");
        let first = texel("ivec3(0)");
        let second = texel("ivec3(equal(uvec3(id % 3u), uvec3(0u, 1u, 2u)))");
        format!("mix({first}, {second}, {weight})")
    }

    #[test]
    fn the_error_of_a_filter_is_found() {
        let choice = DeviceChoice {
            validation: Validation::On,
            ..DeviceChoice::default()
        };
        let device = Device::open(&choice).expect("a Vulkan device and the validation layers");
        let rounded_to = |n: u32| with_weight(&format!("round(exact * {n}.0) / {n}.0"));
        let filters = [
            (with_weight("exact"), 0.0),
            (rounded_to(256), 1.0 / 512.0),
            (rounded_to(128), 1.0 / 256.0),
            (with_weight("step(0.5, exact)"), 0.5),
            (with_weight("exact + 0.01"), 0.01),
        ];
        for (filter, error) in &filters {
            let shaders = Shaders::new(shared::glsl());
            let text = SHADER.replace(FILTER, filter);
            assert_ne!(text, SHADER, "the shader has no `{FILTER}`");
            let shaders = shaders.with_file("filter_probe.comp", &text);
            for format in [Format::R8_UNORM, Format::R16_UNORM, Format::R32_SFLOAT] {
                let found = filter_error(&device, &shaders, format).expect("a probe");
                let found = found.expect("a filter");
                assert!(
                    (found - error).abs() < 1e-3,
                    "{found}: {filter} of {format:?}"
                );
            }
        }
        assert_eq!(device.validation_messages(), [""; 0]);
    }
}
