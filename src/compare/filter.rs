//! One channel of a picture and separable filters of it, shared by the metrics that look at
//! neighbourhoods.

#[derive(Debug, Clone)]
pub(super) struct Plane {
    pub width: usize,
    pub height: usize,
    pub values: Vec<f64>,
}

impl Plane {
    /// A plane of the same size with other values.
    pub fn with(&self, values: Vec<f64>) -> Plane {
        Plane { values, ..*self }
    }

    /// Pixel by pixel.
    pub fn combine(&self, other: &Plane, f: impl Fn(f64, f64) -> f64) -> Plane {
        self.with(
            self.values
                .iter()
                .zip(&other.values)
                .map(|(&a, &b)| f(a, b))
                .collect(),
        )
    }

    /// Filters along rows, then along columns; the border pixels go on for ever. Kernels have odd
    /// lengths.
    pub fn filter(&self, along_rows: &[f64], along_columns: &[f64]) -> Plane {
        self.filter_rows(along_rows).filter_columns(along_columns)
    }

    // Both go tap by tap over whole rows, which the compiler turns into vector code.

    fn filter_rows(&self, kernel: &[f64]) -> Plane {
        let radius = kernel.len() / 2;
        let mut filtered = vec![0.0; self.values.len()];
        let mut padded = vec![0.0; self.width + 2 * radius];
        let rows = self.values.chunks_exact(self.width);
        for (row, out) in rows.zip(filtered.chunks_exact_mut(self.width)) {
            padded[..radius].fill(row[0]);
            padded[radius..][..self.width].copy_from_slice(row);
            padded[radius + self.width..].fill(row[self.width - 1]);
            for (tap, &weight) in kernel.iter().enumerate() {
                add_scaled(out, weight, &padded[tap..]);
            }
        }
        self.with(filtered)
    }

    fn filter_columns(&self, kernel: &[f64]) -> Plane {
        let radius = kernel.len() / 2;
        let mut filtered = vec![0.0; self.values.len()];
        for (y, out) in filtered.chunks_exact_mut(self.width).enumerate() {
            for (tap, &weight) in kernel.iter().enumerate() {
                let source = (y + tap).saturating_sub(radius).min(self.height - 1);
                add_scaled(out, weight, &self.values[source * self.width..]);
            }
        }
        self.with(filtered)
    }
}

fn add_scaled(out: &mut [f64], weight: f64, values: &[f64]) {
    for (out, value) in out.iter_mut().zip(values) {
        *out += weight * value;
    }
}
