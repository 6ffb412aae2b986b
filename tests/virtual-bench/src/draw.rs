//! Seeded random draws; one independent stream a purpose, so that adding a use never shifts another.

use rand_distr::{Distribution, StandardNormal, StandardUniform};
use rand_pcg::Pcg64;

/// A stream of random numbers that depends on a seed and on what it is for.
#[derive(Debug, Clone)]
pub struct Draw {
    generator: Pcg64,
}

impl Draw {
    /// The stream of `seed` for `purpose`.
    pub(crate) fn new(seed: u64, purpose: &str) -> Self {
        // FNV-1a keeps the stream of a purpose fixed across builds, which std's hasher does not promise.
        let stream = purpose.bytes().fold(0xcbf2_9ce4_8422_2325_u64, |hash, byte| {
            (hash ^ u64::from(byte)).wrapping_mul(0x0100_0000_01b3)
        });
        Self {
            generator: Pcg64::new(u128::from(seed).wrapping_mul(0x9e37_79b9_7f4a_7c15), u128::from(stream)),
        }
    }

    /// Normal, mean 0, standard deviation 1.
    pub(crate) fn normal(&mut self) -> f64 {
        StandardNormal.sample(&mut self.generator)
    }

    /// Uniform in `low..high`.
    pub(crate) fn uniform(&mut self, low: f64, high: f64) -> f64 {
        let unit: f64 = StandardUniform.sample(&mut self.generator);
        low + (high - low) * unit
    }

    /// −1 or +1.
    pub(crate) fn sign(&mut self) -> f64 {
        if self.uniform(-1.0, 1.0) < 0.0 { -1.0 } else { 1.0 }
    }

    /// One of `choices`, which must not be empty.
    pub(crate) fn one_of<T: Copy>(&mut self, choices: &[T]) -> T {
        let index = self.uniform(0.0, choices.len() as f64) as usize;
        choices[index.min(choices.len() - 1)]
    }
}
