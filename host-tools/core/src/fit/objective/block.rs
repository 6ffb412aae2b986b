//! Blocks of samples that are compared as one, and what is kept of each.

use super::Part;

/// Of so many stretches one confirms regressions on the others.
const CONFIRMING: usize = 3;

/// Samples that are compared as one.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Block {
    /// First sample.
    pub start: usize,
    /// One past the last sample.
    pub end: usize,
    /// Use of the block.
    pub part: Part,
    /// Number of its stretch of a second among those of the recording that are fitted to, or among those that are held out.
    pub stretch: usize,
}

impl Block {
    /// Whether a regression on the other blocks that are fitted to is confirmed on this one.
    #[must_use]
    pub const fn confirms(&self) -> bool {
        self.stretch % CONFIRMING == CONFIRMING - 1
    }
}

/// Of the samples of one block.
#[derive(Clone, Copy, Debug)]
pub(super) struct Moments {
    pub(super) mean: f64,
    pub(super) variance: f64,
}

pub(super) fn moments(values: &[f64]) -> Moments {
    let n = values.len().max(1) as f64;
    let mean = values.iter().sum::<f64>() / n;
    let variance = values.iter().map(|v| (v - mean).powi(2)).sum::<f64>() / n;
    Moments { mean, variance }
}

/// One entry a block.
pub(super) fn moments_of(values: &[f64], blocks: &[Block]) -> Vec<Moments> {
    blocks.iter().map(|block| moments(&values[block.start..block.end])).collect()
}
