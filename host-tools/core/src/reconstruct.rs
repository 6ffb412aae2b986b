//! Reconstruction of what an encoder could not resolve.

mod quantum;
mod smoother;

use std::collections::VecDeque;

pub use quantum::quantum_of;
pub use smoother::{Motion, smooth};

/// Mean over `2 half + 1` samples around each sample; fewer at the ends. Takes the place of the values.
#[must_use]
pub fn moving_average(mut values: Vec<f64>, half: usize) -> Vec<f64> {
    let n = values.len();
    // Sums of all samples before those from `first` on, as far as they are still needed.
    let mut sums = VecDeque::with_capacity(2 * half + 2);
    sums.push_back(0.0);
    let (mut first, mut sum) = (0, 0.0);
    for k in 0..n {
        let (from, to) = (k.saturating_sub(half), (k + half + 1).min(n));
        while first + sums.len() <= to {
            sum += values[first + sums.len() - 1];
            sums.push_back(sum);
        }
        while first < from {
            sums.pop_front();
            first += 1;
        }
        values[k] = (sums[to - first] - sums[0]) / (to - from) as f64;
    }
    values
}

#[cfg(test)]
mod tests {
    use super::moving_average;

    #[test]
    fn a_moving_average_is_the_mean_of_its_neighbours() {
        let values: Vec<f64> = (0..20_u32).map(|k| f64::from((k * k) % 17) - 3.0).collect();
        for (samples, half) in [(20, 0), (20, 1), (20, 7), (20, 40), (1, 3), (0, 2)] {
            let values = &values[..samples];
            let mean = |k: usize| {
                let near: Vec<f64> =
                    (0..samples).filter(|j| j.abs_diff(k) <= half).map(|j| values[j]).collect();
                near.iter().sum::<f64>() / near.len() as f64
            };
            let averaged = moving_average(values.to_vec(), half);
            assert_eq!(averaged.len(), samples);
            for (k, value) in averaged.iter().enumerate() {
                assert!(
                    (value - mean(k)).abs() < 1e-12,
                    "{half} either side of {k}: {value}, not {}",
                    mean(k)
                );
            }
        }
    }
}
