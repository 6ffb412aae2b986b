//! Reconstruction of what an encoder could not resolve.

mod quantum;
mod smoother;

pub use quantum::quantum_of;
pub use smoother::{Motion, smooth};

/// Mean over `2 half + 1` samples around each sample; fewer at the ends. Takes the place of the values.
#[must_use]
pub fn moving_average(mut values: Vec<f64>, half: usize) -> Vec<f64> {
    let n = values.len();
    let half = half.min(n);
    // Sums of the samples before each, as far as they are still needed: in a ring whose length is a power of two.
    let mut sums = vec![0.0; (2 * half + 2).next_power_of_two()];
    let last = sums.len() - 1;
    let (mut summed, mut sum) = (0, 0.0);
    for k in 0..n {
        let (from, to) = (k.saturating_sub(half), (k + half + 1).min(n));
        while summed < to {
            sum += values[summed];
            summed += 1;
            sums[summed & last] = sum;
        }
        values[k] = (sums[to & last] - sums[from & last]) / (to - from) as f64;
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
