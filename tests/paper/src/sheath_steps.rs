//! How somebody swings both sheaths from one shape to another and back: the wrap angle K goes by pi within a fifth of a second.
//!
//! `K(t) = K_0 ± S cos(pi (t - t_n)/T)` from the beginning `t_n` of a swing until `T` later, at rest between; the rests are random.

use std::f64::consts::PI;

use crate::sheath_motion::{Random, SheathMotionConfig};

/// Time of a swing `T` \[s\].
pub const SWING_S: f64 = 0.2;
/// Shortest and longest time between the beginnings of two swings \[s\].
pub const BETWEEN_S: [f64; 2] = [1.0, 2.0];

/// Swings of both sheaths; equal seeds give equal ones.
#[derive(Debug, Clone)]
pub struct SheathSteps {
    config: SheathMotionConfig,
    /// Beginnings of the swings, the first of them towards the larger K \[s\].
    starts_s: Vec<f64>,
}

impl SheathSteps {
    /// The swings of `seed` up to `end_s`, between the least and the largest K of `config`.
    #[must_use]
    pub fn new(config: SheathMotionConfig, end_s: f64, seed: u64) -> Self {
        let mut random = Random::new(seed);
        let [shortest, longest] = BETWEEN_S;
        let mut starts_s = Vec::new();
        let mut time_s = 0.0;
        while time_s < end_s {
            time_s += shortest + (longest - shortest) * random.uniform();
            starts_s.push(time_s);
        }
        Self { config, starts_s }
    }

    /// Wrap angle of both sheaths \[rad\].
    #[must_use]
    pub fn wrap_angle_rad(&self, time_s: f64) -> f64 {
        let SheathMotionConfig { middle_rad, span_rad, .. } = self.config;
        let begun = self.starts_s.partition_point(|start_s| *start_s <= time_s);
        let (sign, done) = match begun.checked_sub(1) {
            Some(last) => {
                let done = ((time_s - self.starts_s[last]) / SWING_S).min(1.0);
                (if last.is_multiple_of(2) { -1.0 } else { 1.0 }, done)
            }
            None => (-1.0, 0.0),
        };
        middle_rad + sign * span_rad * (PI * done).cos()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn each_swing_takes_a_fifth_of_a_second_and_a_half_turn() {
        let steps = SheathSteps::new(SheathMotionConfig::BY_HAND, 30.0, 3);
        let samples: Vec<f64> = (0..300_000).map(|n| steps.wrap_angle_rad(f64::from(n) * 1e-4)).collect();
        assert!((samples[0] - 0.5 * PI).abs() < 1e-12);
        let moving = samples.windows(2).filter(|pair| pair[0] != pair[1]).count();
        let swings = steps.starts_s.iter().filter(|start_s| **start_s + SWING_S < 30.0).count();
        assert!((15..=30).contains(&swings), "{swings}");
        // 2000 samples a swing; one more that the end of the half minute may cut short.
        assert!(moving.abs_diff(2000 * swings) <= 2000, "{moving} in {swings} swings");
        for pair in samples.windows(2) {
            // No jump: at most half of pi times the span in a swing.
            assert!((pair[1] - pair[0]).abs() <= 0.5 * PI * PI / SWING_S * 1e-4 * 1.001, "{pair:?}");
        }
        // Before the first swing it is the smaller K, before the second the larger one.
        for (start_s, wanted) in steps.starts_s.iter().zip([0.5 * PI, 1.5 * PI]) {
            assert!((steps.wrap_angle_rad(start_s - 1e-3) - wanted).abs() < 1e-9);
        }
    }
}
