//! Repeatable pseudo-random numbers for histories of motion.

/// Linear congruential generator (Knuth, TAOCP vol. 2, MMIX constants).
pub struct Random(u64);

impl Random {
    /// Sequence number `seed`.
    pub fn new(seed: u64) -> Self {
        Self(seed.wrapping_mul(0x9e37_79b9_7f4a_7c15).wrapping_add(1))
    }

    /// Next number, evenly spread over -1 to 1.
    pub fn signed(&mut self) -> f64 {
        self.0 = self.0.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        (self.0 >> 11) as f64 / (1u64 << 52) as f64 - 1.0
    }
}
