//! From linear radiance to what a display shows, for the PNG and for metrics on display values.

use crate::scene::Tone;

/// Linear radiance to a display value in [0, 1].
pub fn display_value(linear: f64, exposure: f64, tone: Tone) -> f64 {
    let exposed = linear * exposure.exp2();
    srgb_encode(match tone {
        Tone::Linear => exposed.clamp(0.0, 1.0),
        Tone::Filmic => filmic(exposed),
    })
}

/// Krzysztof Narkowicz's fit of the ACES curve ("ACES Filmic Tone Mapping Curve", 2016).
fn filmic(x: f64) -> f64 {
    // The fraction tends to 2.51 / 2.43, but ∞/∞ is undefined.
    let x = x.clamp(0.0, 1e6);
    ((x * (2.51 * x + 0.03)) / (x * (2.43 * x + 0.59) + 0.14)).min(1.0)
}

/// IEC 61966-2-1, for values in [0, 1].
pub fn srgb_encode(linear: f64) -> f64 {
    if linear <= 0.003_130_8 {
        12.92 * linear
    } else {
        1.055 * linear.powf(1.0 / 2.4) - 0.055
    }
}

/// The inverse of [`srgb_encode`].
pub fn srgb_decode(encoded: f64) -> f64 {
    if encoded <= 0.040_45 {
        encoded / 12.92
    } else {
        ((encoded + 0.055) / 1.055).powf(2.4)
    }
}
