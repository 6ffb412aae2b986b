//! Random draws that depend on a name alone.

use rand_distr::{Distribution, StandardUniform};
use rand_pcg::Pcg64;

/// A stream of random numbers.
#[derive(Debug, Clone)]
pub struct Draw(Pcg64);

impl Draw {
    /// The stream of `name`, the same in every build.
    pub fn of(name: &str) -> Self {
        // FNV-1a: std's hasher does not promise to stay.
        let hash = name.bytes().fold(0xcbf2_9ce4_8422_2325_u64, |hash, byte| {
            (hash ^ u64::from(byte)).wrapping_mul(0x0100_0000_01b3)
        });
        Self(Pcg64::new(u128::from(hash), 0x0fa1_7000))
    }

    /// Uniform in `low..high`.
    pub fn uniform(&mut self, low: f64, high: f64) -> f64 {
        let unit: f64 = StandardUniform.sample(&mut self.0);
        low + (high - low) * unit
    }

    /// From `low` to `high`, both above 0, every factor equally likely.
    pub fn over_decades(&mut self, low: f64, high: f64) -> f64 {
        self.uniform(low.ln(), high.ln()).exp()
    }

    /// −1 or 1.
    pub fn sign(&mut self) -> f64 {
        if self.uniform(-1.0, 1.0) < 0.0 { -1.0 } else { 1.0 }
    }

    /// True with this probability.
    pub fn chance(&mut self, probability: f64) -> bool {
        self.uniform(0.0, 1.0) < probability
    }

    /// 0 to `count - 1`.
    pub fn index(&mut self, count: usize) -> usize {
        (self.uniform(0.0, count as f64) as usize).min(count.saturating_sub(1))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_name_has_its_own_numbers_within_their_ranges() {
        let draws = |name: &str| {
            let mut draw = Draw::of(name);
            [draw.uniform(2.0, 3.0), draw.over_decades(1e-3, 1.0), draw.sign(), draw.index(4) as f64]
        };
        assert_eq!(draws("a/fast/1"), draws("a/fast/1"));
        assert_ne!(draws("a/fast/1"), draws("a/fast/2"));
        for number in 0..200 {
            let [uniform, decades, sign, index] = draws(&number.to_string());
            assert!((2.0..3.0).contains(&uniform) && (1e-3..1.0).contains(&decades));
            assert!(sign.abs() == 1.0 && (0.0..4.0).contains(&index));
        }
    }
}
