//! The participating medium: a transfer function from values to opacity and colour.

/// One point of the piecewise-linear transfer function.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct TransferPoint {
    /// The value, in the data's units.
    pub value: f64,
    /// α ∈ [0, 1]; extinction is density·α.
    pub opacity: f64,
    /// Single-scattering albedo per channel, in [0, 1].
    pub color: [f64; 3],
}

#[derive(Debug, Clone, PartialEq)]
pub struct Medium {
    /// σt where α = 1, per world unit; ≥ 0.
    pub density: f64,
    /// Henyey–Greenstein asymmetry in (−1, 1), g > 0 forward.
    pub g: f64,
    /// At least one point, values non-decreasing; two at one value make a step (V ≥ value takes the
    /// second); constant beyond the ends.
    pub transfer: Vec<TransferPoint>,
}

impl Medium {
    /// A medium that scatters evenly in all directions.
    pub fn isotropic(density: f64, transfer: Vec<TransferPoint>) -> Medium {
        Medium {
            density,
            g: 0.0,
            transfer,
        }
    }

    /// The default density: an optical depth of 50 along the box's longest side.
    pub fn default_density(extent: [f64; 3]) -> f64 {
        50.0 / extent.into_iter().fold(0.0, f64::max)
    }

    /// Opacity and colour at a value.
    pub fn classify(&self, value: f64) -> (f64, [f64; 3]) {
        let points = &self.transfer;
        let next = points.partition_point(|p| p.value <= value);
        if next == 0 {
            return (points[0].opacity, points[0].color);
        }
        let low = points[next - 1];
        let Some(high) = points.get(next) else {
            return (low.opacity, low.color);
        };
        let t = (value - low.value) / (high.value - low.value);
        let mix = |a: f64, b: f64| a + t * (b - a);
        (
            mix(low.opacity, high.opacity),
            std::array::from_fn(|c| mix(low.color[c], high.color[c])),
        )
    }
}
