//! Resolution of a sensor, from what it recorded.
//!
//! A slow signal repeats its value until the next step. A fast one steps at every sample and repeats nothing: an encoder of 12 bits
//! at 1 kHz from 1.2 rad/s on, at 100 Hz from 0.12 rad/s on. Its values are still whole numbers of steps, and what lies between
//! two of them moves on evenly to within a step; noise above a step does not, and neither does a smooth signal whose only steps
//! are the decimals of its file.

/// Part of the samples that repeat the value before, from which on a signal is stepped.
const REPEATING: f64 = 0.25;

/// Farthest from a whole number of steps that a change is allowed to be, in steps.
const OFF_LATTICE: f64 = 0.05;

/// Part of all changes that are whole numbers of steps on a lattice; spikes that were mended are not.
const ON_LATTICE: f64 = 0.99;

/// Part of the samples at which the change itself changes by one step or less. The counts of an even motion change by `n` or `n + 1`
/// steps a sample, of which two differ by one at most; noise with a standard deviation of one step leaves 0.46 of all.
const EVEN: f64 = 0.75;

/// Resolution of a signal, `None` for one that is not stepped.
///
/// The resolution is the smallest difference of two samples one after the other; they are differences in the unit of the signal.
/// Stepped is a signal of which one sample in four repeats the one before, or one that lies on a lattice of that resolution
/// and moves on evenly to within a step.
#[must_use]
pub fn quantum_of(values: &[f64]) -> Option<f64> {
    let span = values.iter().fold(0.0_f64, |m, v| m.max(v.abs()));
    let same = span * 1e-9;
    let changes = || values.windows(2).map(|pair| pair[1] - pair[0]);
    let repeats = changes().filter(|change| change.abs() <= same).count();
    let quantum = changes().map(f64::abs).filter(|change| *change > same).fold(f64::INFINITY, f64::min);
    if !quantum.is_finite() {
        return None;
    }
    let part = |count: usize, of: usize| count as f64 / of.max(1) as f64;
    if part(repeats, values.len()) > REPEATING {
        return Some(quantum);
    }
    let steps = || changes().map(|change| change / quantum);
    let whole = steps().filter(|steps| (steps - steps.round()).abs() <= OFF_LATTICE).count();
    let even = steps().zip(steps().skip(1)).filter(|(a, b)| (b.round() - a.round()).abs() <= 1.0).count();
    let (changes, pairs) = (values.len() - 1, values.len() - 2);
    (part(whole, changes) >= ON_LATTICE && part(even, pairs) >= EVEN).then_some(quantum)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// One count of 12 bits \[rad\].
    const COUNT_RAD: f64 = std::f64::consts::TAU / 4096.0;

    fn counted(value: f64, quantum: f64) -> f64 {
        (value / quantum).round() * quantum
    }

    /// 8 s of two sines of 3 rad/s at most.
    fn swing_rad(rate_hz: f64) -> Vec<f64> {
        let samples = (8.0 * rate_hz) as u32;
        let angle_rad = |t_s: f64| 0.4 * (4.0 * t_s).sin() + 0.2 * (7.0 * t_s).sin();
        (0..samples).map(|k| angle_rad(f64::from(k) / rate_hz)).collect()
    }

    /// Normal to within the sum of twelve, from a congruential generator.
    fn noise(samples: usize) -> Vec<f64> {
        let mut state = 1_u64;
        let mut uniform = || {
            state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
            (state >> 11) as f64 / (1_u64 << 53) as f64
        };
        (0..samples).map(|_| (0..12).map(|_| uniform()).sum::<f64>() - 6.0).collect()
    }

    #[test]
    fn an_encoder_is_recognised_however_fast_it_turns() {
        for rate_hz in [10_000.0, 1000.0, 400.0, 100.0] {
            let counts: Vec<f64> = swing_rad(rate_hz).iter().map(|rad| counted(*rad, COUNT_RAD)).collect();
            let quantum = quantum_of(&counts).unwrap_or_default();
            assert!((quantum - COUNT_RAD).abs() < 1e-9, "{rate_hz} Hz: {quantum}");
        }
        let repeating = |rate_hz: f64| {
            let counts: Vec<f64> = swing_rad(rate_hz).iter().map(|rad| counted(*rad, COUNT_RAD)).collect();
            counts.windows(2).filter(|pair| (pair[1] - pair[0]).abs() < 1e-9).count() as f64
                / counts.len() as f64
        };
        // Both ways of telling are needed.
        assert!(repeating(10_000.0) > REPEATING && repeating(400.0) < REPEATING);
    }

    #[test]
    fn decimals_of_a_file_and_noise_over_many_steps_are_no_resolution() {
        let decimals: Vec<f64> = swing_rad(1000.0).iter().map(|rad| counted(*rad, 1e-7)).collect();
        assert_eq!(quantum_of(&decimals), None);
        assert_eq!(quantum_of(&swing_rad(1000.0)), None);
        // A tension of 0.1 N noise in steps of 24 mN: noise is what limits it.
        let tension: Vec<f64> = noise(4000).iter().map(|n| counted(30.0 + 0.1 * n, 0.024)).collect();
        assert_eq!(quantum_of(&tension), None);
    }

    #[test]
    fn what_never_changes_has_no_resolution() {
        assert_eq!(quantum_of(&[1.0; 10]), None);
        assert_eq!(quantum_of(&[]), None);
        assert_eq!(quantum_of(&[1.0]), None);
        // One change alone tells of no lattice and repeats nothing.
        assert_eq!(quantum_of(&[1.0, 2.0]), None);
    }
}
