//! The difference of two pictures.

/// Mean over pixels and RGB of the squared difference.
pub fn mean_square(a: &[[f32; 4]], b: &[[f32; 4]]) -> f64 {
    let pairs = a.iter().zip(b);
    let squares = pairs.flat_map(|(a, b)| (0..3).map(|c| f64::from(a[c] - b[c]).powi(2)));
    squares.sum::<f64>() / (3 * a.len().max(1)) as f64
}
