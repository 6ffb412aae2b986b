//! Blocks of samples that are compared as one, and what is kept of each.

use super::Part;

/// Samples that are compared as one.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Block {
    /// First sample.
    pub start: usize,
    /// One past the last sample.
    pub end: usize,
    /// Use of the block.
    pub part: Part,
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
