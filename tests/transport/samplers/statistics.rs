//! Means with their errors, and Pearson's χ².

/// Mean and its standard error.
pub fn estimate(samples: impl Iterator<Item = f64>) -> (f64, f64) {
    let (mut n, mut mean, mut squares) = (0.0, 0.0, 0.0);
    for x in samples {
        n += 1.0;
        let change = x - mean;
        mean += change / n;
        squares += change * (x - mean);
    }
    (mean, (squares / (n - 1.0) / n).sqrt())
}

pub fn assert_mean(what: &str, samples: impl Iterator<Item = f64>, exact: f64) {
    let (mean, error) = estimate(samples);
    assert!(
        (mean - exact).abs() <= 4.0 * error,
        "{what}: {mean} ± {error}, expected {exact}"
    );
}

/// Pearson's χ² over (found, expected) counts: as many standard deviations of a normal variable as
/// the same tail of the χ² distribution (Wilson and Hilferty 1931). Bins that expect fewer than 10
/// are pooled.
pub fn chi_squared(bins: &[(f64, f64)]) -> f64 {
    let (dense, sparse): (Vec<_>, Vec<_>) = bins.iter().copied().partition(|b| b.1 >= 10.0);
    let pooled = sparse
        .iter()
        .fold((0.0, 0.0), |sum, b| (sum.0 + b.0, sum.1 + b.1));
    // A pool that is dropped below may have five of its standard deviations more than it expects, and 2e-4 of all samples:
    // by so much sums over a narrow lobe are off.
    let all: f64 = bins.iter().map(|b| b.1).sum();
    let most = pooled.1 + 5.0 * pooled.1.max(1.0).sqrt() + 2e-4 * all;
    assert!(
        pooled.0 <= most,
        "{} samples where {} are expected",
        pooled.0,
        pooled.1
    );
    let kept = dense
        .into_iter()
        .chain((pooled.1 >= 10.0).then_some(pooled));
    let terms: Vec<f64> = kept.map(|(o, e)| (o - e).powi(2) / e).collect();
    let freedom = terms.len() as f64 - 1.0;
    let spread = 2.0 / (9.0 * freedom);
    ((terms.iter().sum::<f64>() / freedom).cbrt() - (1.0 - spread)) / spread.sqrt()
}

/// At a significance of 1e-3.
pub fn assert_fits(what: &str, bins: &[(f64, f64)]) {
    let z = chi_squared(bins);
    let expected: f64 = bins.iter().map(|b| b.1).sum();
    let found: f64 = bins.iter().map(|b| b.0).sum();
    assert!(
        (found - expected).abs() < 1e-3 * expected,
        "{what}: {found} samples for {expected}"
    );
    assert!(z < 3.09, "{what}: χ² is {z:.2} deviations too large");
}

/// Counts of the values of `index` below `bins`, beside as many uniform expectations.
pub fn uniform_bins(bins: usize, indices: impl Iterator<Item = usize>) -> Vec<(f64, f64)> {
    let mut counts = vec![0.0; bins];
    let mut total = 0.0;
    for index in indices {
        counts[index] += 1.0;
        total += 1.0;
    }
    counts
        .into_iter()
        .map(|c| (c, total / bins as f64))
        .collect()
}
