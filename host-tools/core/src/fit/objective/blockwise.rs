//! A replay compared while it runs, block by block.

use bowden_model::channel::Channel;

use super::Series;
use super::block::{Moments, moments};
use super::dataset::Dataset;
use crate::simulation::Sink;

/// Takes a replay block by block: a fit needs no more of it, and an hour of samples would not fit into memory once a thread.
pub(super) struct Blockwise<'a> {
    dataset: &'a Dataset,
    /// Where each series of the recording stands among the outputs; `None` for the torque that guides the motor.
    outputs: Vec<Option<usize>>,
    /// Whether each is cut at zero.
    cut_at_zero: Vec<bool>,
    /// Of every series, as far as the replay has come.
    pub(super) simulated: Vec<Vec<Moments>>,
    /// Samples of the block so far, one list a series.
    open: Vec<Vec<f64>>,
    samples: usize,
    block: usize,
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
        Self {
            outputs: channels().map(|channel| channel.and_then(place)).collect(),
            cut_at_zero: channels().map(|channel| channel.is_some_and(is_cut)).collect(),
            simulated: channels().map(|_| room()).collect(),
            open: vec![Vec::new(); dataset.measured.len()],
            samples: 0,
            block: 0,
            dataset,
        }
    }
}

impl Sink for Blockwise<'_> {
    fn sample(&mut self, outputs: &[f64], guide_nm: Option<f64>) {
        let Some(block) = self.dataset.blocks.get(self.block).copied() else { return };
        if self.samples >= block.start {
            for ((values, output), cut) in self.open.iter_mut().zip(&self.outputs).zip(&self.cut_at_zero) {
                let value = output.map_or(guide_nm.unwrap_or(0.0), |place| outputs[place]);
                values.push(if *cut { value.max(0.0) } else { value });
            }
        }
        self.samples += 1;
        if self.samples == block.end {
            for (values, simulated) in self.open.iter_mut().zip(&mut self.simulated) {
                simulated.push(moments(values));
                values.clear();
            }
            self.block += 1;
        }
    }
}
