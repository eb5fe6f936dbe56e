//! Conversion from linear radiance to display values, for the PNG and for metrics on display values.

use crate::scene::Tone;
use crate::srgb;

/// Linear radiance to a display value in [0, 1].
pub fn display_value(linear: f64, exposure: f64, tone: Tone) -> f64 {
    let exposed = linear * exposure.exp2();
    srgb::encode(match tone {
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
