//! Reconstruction of what an encoder could not resolve.

mod smoother;

pub use smoother::{Motion, quantum_of, smooth};

/// Mean over `2 half + 1` samples around each sample; fewer at the ends.
#[must_use]
pub fn moving_average(values: &[f64], half: usize) -> Vec<f64> {
    let n = values.len();
    let mut sums = Vec::with_capacity(n + 1);
    sums.push(0.0);
    let mut sum = 0.0;
    for value in values {
        sum += value;
        sums.push(sum);
    }
    (0..n)
        .map(|k| {
            let (from, to) = (k.saturating_sub(half), (k + half + 1).min(n));
            (sums[to] - sums[from]) / (to - from) as f64
        })
        .collect()
}
