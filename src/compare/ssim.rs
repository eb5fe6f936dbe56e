//! Structural similarity (Wang, Bovik, Sheikh, Simoncelli 2004) with their Gaussian window.
//!
//! Numerically scikit-image's `structural_similarity(gaussian_weights=True, sigma=1.5,
//! use_sample_covariance=False)`: the window ends at 3.5 σ, and pixels closer to the border than
//! its radius do not count.

use super::filter::Plane;

const SIGMA: f64 = 1.5;
const RADIUS: usize = 5;
/// The paper's stabilizers for a data range of 1.
const C1: f64 = 0.01 * 0.01;
const C2: f64 = 0.03 * 0.03;

/// The mean over channels; `None` where a side is shorter than the window.
pub(super) fn ssim(reference: &[Plane; 3], test: &[Plane; 3]) -> Option<f64> {
    let [Plane { width, height, .. }, ..] = reference;
    let fits = (*width).min(*height) > 2 * RADIUS;
    let channels = reference.iter().zip(test);
    fits.then(|| channels.map(|(r, t)| channel_ssim(r, t)).sum::<f64>() / 3.0)
}

fn channel_ssim(reference: &Plane, test: &Plane) -> f64 {
    let window = window();
    let local_mean = |plane: &Plane| plane.filter(&window, &window).values;
    let product = |a: &Plane, b: &Plane| a.combine(b, |a, b| a * b);
    let mean_r = local_mean(reference);
    let mean_t = local_mean(test);
    let mean_rr = local_mean(&product(reference, reference));
    let mean_tt = local_mean(&product(test, test));
    let mean_rt = local_mean(&product(reference, test));

    let similarity = |i: usize| {
        let (r, t) = (mean_r[i], mean_t[i]);
        let variances = mean_rr[i] - r * r + mean_tt[i] - t * t;
        let covariance = mean_rt[i] - r * t;
        ((2.0 * r * t + C1) * (2.0 * covariance + C2)) / ((r * r + t * t + C1) * (variances + C2))
    };
    let (columns, rows) = (
        RADIUS..reference.width - RADIUS,
        RADIUS..reference.height - RADIUS,
    );
    let count = (columns.len() * rows.len()) as f64;
    let inner = rows.flat_map(|y| columns.clone().map(move |x| y * reference.width + x));
    inner.map(similarity).sum::<f64>() / count
}

fn window() -> [f64; 2 * RADIUS + 1] {
    let gaussian: [f64; 2 * RADIUS + 1] = std::array::from_fn(|tap| {
        let x = tap as f64 - RADIUS as f64;
        (-0.5 * (x / SIGMA).powi(2)).exp()
    });
    let sum: f64 = gaussian.iter().sum();
    gaussian.map(|weight| weight / sum)
}
