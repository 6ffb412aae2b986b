//! How an operator moves the sheaths at random: wrap angles K of both over time.
//!
//! `K_n(t) = K_0 + S ((1 - d) tanh g(t) + d tanh h_n(t))`, n = a, b. `g` is common to both sheaths, `h_a` and `h_b` are their
//! small difference. Each is a sum of [`LINES`] sines of equal amplitude, of variance 1 together, with frequencies spread
//! evenly over the band and a random phase each; `tanh` keeps K within `K_0 ± S` and smooth.

use std::f64::consts::{PI, TAU};

/// Sines of each random course.
pub const LINES: usize = 12;

/// Bounds and band of the motion.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SheathMotionConfig {
    /// Middle of the wrap angle `K_0` \[rad\].
    pub middle_rad: f64,
    /// Largest deviation S from `K_0` \[rad\].
    pub span_rad: f64,
    /// Part d of the span in which the two sheaths differ \[1\].
    pub difference: f64,
    /// Lowest and highest frequency \[Hz\].
    pub band_hz: [f64; 2],
}

impl SheathMotionConfig {
    /// K between 0.5 π and 1.5 π, the range of Fig. 9b; 0.02 to 0.3 Hz; a tenth of the span differs between the sheaths.
    pub const BY_HAND: Self =
        Self { middle_rad: PI, span_rad: 0.5 * PI, difference: 0.1, band_hz: [0.02, 0.3] };
}

/// A sum of sines.
#[derive(Debug, Clone)]
struct Course {
    /// Frequency \[Hz\] and phase \[rad\].
    lines: [(f64, f64); LINES],
}

impl Course {
    fn new(config: &SheathMotionConfig, random: &mut Random) -> Self {
        let [low, high] = config.band_hz;
        let width = (high - low) / LINES as f64;
        // One line at a random place in each of equal parts of the band: no two courses have a common period.
        let lines = std::array::from_fn(|n| {
            let frequency = low + width * (n as f64 + random.uniform());
            (frequency, TAU * random.uniform())
        });
        Self { lines }
    }

    fn value(&self, time_s: f64) -> f64 {
        let amplitude = (2.0 / LINES as f64).sqrt();
        self.lines.iter().map(|(frequency, phase)| amplitude * (TAU * frequency * time_s + phase).sin()).sum()
    }
}

/// Random motion of both sheaths; equal seeds give equal motions.
#[derive(Debug, Clone)]
pub struct SheathMotion {
    config: SheathMotionConfig,
    common: Course,
    own: [Course; 2],
}

impl SheathMotion {
    /// The motion of `seed`.
    #[must_use]
    pub fn new(config: SheathMotionConfig, seed: u64) -> Self {
        let mut random = Random::new(seed);
        let common = Course::new(&config, &mut random);
        let own = std::array::from_fn(|_| Course::new(&config, &mut random));
        Self { config, common, own }
    }

    /// Wrap angles of the sheaths of cable a and b \[rad\].
    #[must_use]
    pub fn wrap_angle_rad(&self, time_s: f64) -> [f64; 2] {
        let SheathMotionConfig { middle_rad, span_rad, difference, .. } = self.config;
        let common = self.common.value(time_s).tanh();
        self.own.each_ref().map(|own| {
            let own = own.value(time_s).tanh();
            middle_rad + span_rad * ((1.0 - difference) * common + difference * own)
        })
    }
}

/// `SplitMix64` (Steele, Lea, Flood 2014).
pub(crate) struct Random(u64);

impl Random {
    /// Equal seeds give equal numbers.
    pub(crate) const fn new(seed: u64) -> Self {
        Self(seed)
    }

    /// Uniform in 0..1.
    pub(crate) fn uniform(&mut self) -> f64 {
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let mut bits = self.0;
        bits = (bits ^ (bits >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        bits = (bits ^ (bits >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        bits ^= bits >> 31;
        (bits >> 11) as f64 / (1_u64 << 53) as f64
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn samples(seed: u64) -> Vec<[f64; 2]> {
        let motion = SheathMotion::new(SheathMotionConfig::BY_HAND, seed);
        (0..20_000).map(|n| motion.wrap_angle_rad(f64::from(n) * 0.01)).collect()
    }

    #[test]
    fn wrap_angles_stay_within_bounds_and_use_most_of_them() {
        for seed in 1..20 {
            let samples = samples(seed);
            let (low, high) = samples
                .iter()
                .flatten()
                .fold((f64::MAX, f64::MIN), |(low, high), k| (low.min(*k), high.max(*k)));
            assert!(low >= 0.5 * PI && high <= 1.5 * PI, "seed {seed}: {low} to {high}");
            assert!(low < 0.7 * PI && high > 1.3 * PI, "seed {seed}: {low} to {high}");
        }
    }

    #[test]
    fn wrap_angles_are_smooth() {
        // |dg/dt| ≤ sqrt(2/12)·TAU·Σf: twelve lines of 0.16 Hz on average, each at most a 24th of the band above its place.
        let sum_hz: f64 = (0..LINES).map(|n| 0.02 + 0.28 / 12.0 * (n as f64 + 1.0)).sum();
        let steepest = 0.5 * PI * (2.0 / LINES as f64).sqrt() * TAU * sum_hz;
        for seed in 1..20 {
            for pair in samples(seed).windows(2) {
                for (before, after) in pair[0].into_iter().zip(pair[1]) {
                    let rate = (after - before).abs() / 0.01;
                    assert!(rate <= steepest, "{rate} rad/s");
                }
            }
        }
    }

    #[test]
    fn sheaths_differ_a_little_and_seeds_a_lot() {
        let (one, same, other) = (samples(1), samples(1), samples(2));
        assert_eq!(one, same);
        let mean = |f: &dyn Fn(usize) -> f64| (0..one.len()).map(f).sum::<f64>() / one.len() as f64;
        let between_sheaths = mean(&|n| (one[n][0] - one[n][1]).abs());
        let between_seeds = mean(&|n| (one[n][0] - other[n][0]).abs());
        // Two tanh of variance-1 courses, 0.1·0.5 π each: at most 0.314 rad apart, on average about a third of it.
        assert!((0.03..0.2).contains(&between_sheaths), "{between_sheaths}");
        assert!(between_seeds > 0.5, "{between_seeds}");
    }
}
