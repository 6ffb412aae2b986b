//! A replay compared while it runs, block by block.

use bowden_model::channel::Channel;

use super::Series;
use super::block::{Block, Moments, moments};
use super::dataset::Dataset;
use crate::simulation::Sink;

/// Takes a replay block by block: a fit needs no more of it, and an hour of samples would not fit into memory once a thread.
pub(super) struct Blockwise<'a> {
    /// Where each series of the recording stands in a row: the outputs, and behind them the torque that guides the motor.
    columns: Vec<usize>,
    /// Whether each is cut at zero.
    cut_at_zero: Vec<bool>,
    /// Of every series, as far as the replay has come.
    pub(super) simulated: Vec<Vec<Moments>>,
    /// Samples of the block so far, row by row.
    open: Vec<f64>,
    /// Values of one series in that block.
    column: Vec<f64>,
    samples: usize,
    /// The block, and those behind it.
    block: Option<Block>,
    later: std::slice::Iter<'a, Block>,
}

impl<'a> Blockwise<'a> {
    pub(super) fn new(dataset: &'a Dataset) -> Self {
        let channels = || {
            dataset.measured.iter().map(|(series, _)| match series {
                Series::Channel(channel) => Some(*channel),
                Series::Guide => None,
            })
        };
        let place = |channel: Channel| dataset.outputs.iter().position(|output| *output == channel);
        let is_cut = |channel: Channel| dataset.cut_at_zero.contains(&channel);
        let room = || Vec::with_capacity(dataset.blocks.len());
        let mut later = dataset.blocks.iter();
        Self {
            columns: channels()
                .map(|channel| channel.and_then(place).unwrap_or(dataset.outputs.len()))
                .collect(),
            cut_at_zero: channels().map(|channel| channel.is_some_and(is_cut)).collect(),
            simulated: channels().map(|_| room()).collect(),
            open: Vec::new(),
            column: Vec::new(),
            samples: 0,
            block: later.next().copied(),
            later,
        }
    }
}

impl Sink for Blockwise<'_> {
    fn sample(&mut self, outputs: &[f64], guide_nm: Option<f64>) {
        let Some(block) = &self.block else { return };
        if self.samples >= block.start {
            self.open.extend_from_slice(outputs);
            self.open.push(guide_nm.unwrap_or(0.0));
        }
        self.samples += 1;
        if self.samples == block.end {
            let row = outputs.len() + 1;
            for ((column, cut), simulated) in
                self.columns.iter().zip(&self.cut_at_zero).zip(&mut self.simulated)
            {
                let values = self.open.iter().skip(*column).step_by(row);
                let shown = values.map(|value| if *cut { value.max(0.0) } else { *value });
                self.column.clear();
                self.column.extend(shown);
                simulated.push(moments(&self.column));
            }
            self.open.clear();
            self.block = self.later.next().copied();
        }
    }
}
