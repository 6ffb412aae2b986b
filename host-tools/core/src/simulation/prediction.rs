//! What a replay predicts, kept or handed on sample by sample.

use bowden_model::channel::Channel;
use bowden_model::effect::ActiveEffect;
use bowden_model::effect_set::EffectSet;

use super::input::ReplayInput;
use super::sensors::{cut_off, through};
use crate::outcome::Failure;
use crate::progress::Progress;

/// Predicted channels, one value a sample.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Prediction {
    pub(super) channels: Vec<(Channel, Vec<f64>)>,
    /// Torque that guided the motor, N·m at the input pulley; what its model does not explain. Empty where none was
    /// needed.
    pub guide_nm: Vec<f64>,
}

impl Prediction {
    /// One channel.
    #[must_use]
    pub fn channel(&self, channel: Channel) -> Option<&[f64]> {
        self.channels.iter().find(|(c, _)| *c == channel).map(|(_, values)| values.as_slice())
    }

    /// One channel of the same joint seen with one more effect on its sensor, in the last place; empty for what was not
    /// predicted. At the end of a scale it takes what is shown for what there is.
    ///
    /// # Errors
    /// When the set of one effect cannot be made.
    pub fn seen_through(
        &self,
        channel: Channel,
        effect: ActiveEffect,
        input: &ReplayInput,
    ) -> Result<Vec<f64>, Failure> {
        let effects = EffectSet::from_slice(&[effect]).map_err(Failure::bad_input)?;
        let values = self.channel(channel).unwrap_or_default();
        let clocks_s: Vec<f64> = (0..values.len()).map(|k| input.clock_at_s(k)).collect();
        let largest = input.largest_shown(channel);
        Ok(through(&clocks_s, values, |states, port| {
            effects.measure(channel, states, port);
            port.value = cut_off(port.value, largest);
        }))
    }

    /// Values of a channel, which is left empty; empty for what was not predicted.
    pub fn take(&mut self, channel: Channel) -> Vec<f64> {
        let found = self.channels.iter_mut().find(|(c, _)| *c == channel);
        found.map(|(_, values)| std::mem::take(values)).unwrap_or_default()
    }

    /// All channels, to be changed.
    pub fn channels_mut(&mut self) -> impl Iterator<Item = (Channel, &mut [f64])> {
        self.channels.iter_mut().map(|(channel, values)| (*channel, values.as_mut_slice()))
    }

    /// All channels.
    pub fn channels(&self) -> impl Iterator<Item = (Channel, &[f64])> {
        self.channels.iter().map(|(channel, values)| (*channel, values.as_slice()))
    }
}

/// What takes the samples of a replay, so that nobody has to keep them who only compares.
pub trait Sink {
    /// The next sample: every output in the order in which they were asked for, and the torque that guided the motor, N·m at the input
    /// pulley, where one did.
    fn sample(&mut self, outputs: &[f64], guide_nm: Option<f64>);

    /// Whether the replay is to end before the next sample.
    fn is_stopped(&self) -> bool {
        false
    }
}

/// Keeps everything until an early end is asked for.
pub(super) struct Watched<'a> {
    pub prediction: Prediction,
    pub progress: &'a dyn Progress,
}

impl Sink for Watched<'_> {
    fn sample(&mut self, outputs: &[f64], guide_nm: Option<f64>) {
        self.prediction.sample(outputs, guide_nm);
    }

    fn is_stopped(&self) -> bool {
        self.progress.interrupted()
    }
}

/// Keeps everything until another sink is stopped.
pub(super) struct StoppedBy<'a, S> {
    pub prediction: Prediction,
    pub sink: &'a mut S,
}

impl<S: Sink> Sink for StoppedBy<'_, S> {
    fn sample(&mut self, outputs: &[f64], guide_nm: Option<f64>) {
        self.prediction.sample(outputs, guide_nm);
    }

    fn is_stopped(&self) -> bool {
        self.sink.is_stopped()
    }
}

/// Keeps everything.
impl Sink for Prediction {
    fn sample(&mut self, outputs: &[f64], guide_nm: Option<f64>) {
        for ((_, values), value) in self.channels.iter_mut().zip(outputs) {
            values.push(*value);
        }
        self.guide_nm.extend(guide_nm);
    }
}
