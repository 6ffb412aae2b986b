//! Sensors of a replay: channels as they would show without noise and steps, up to the end of their scale.

use bowden_model::channel::Channel;
use bowden_model::effect::{ActiveEffect, EffectState, SensorPort};
use bowden_model::effect_set::{EffectSet, EffectStates, FRESH_STATES};
use bowden_model::parameters::SensorParameters;
use bowden_model::plant::{Plant, PlantConfig};

use super::input::ReplayInput;
use crate::recording::Recording;

/// The largest value of a tension channel that reached the end of its scale in a recording, N; `None` where it kept below.
///
/// A tension beyond `tension_full_scale_n` is shown as the last step of the converter. A channel that shows more than its rig file grants it
/// has another scale, of which the end is not known.
pub(super) fn end_of_scale_n(
    sensors: &SensorParameters,
    recording: &Recording,
    channel: Channel,
) -> Option<f64> {
    if !Channel::TENSIONS.contains(&channel) {
        return None;
    }
    let largest_n = recording.channel(channel)?.iter().copied().fold(f64::NEG_INFINITY, f64::max);
    let (full_scale_n, step_n) = (sensors.tension_full_scale_n, sensors.tension_step_n());
    (full_scale_n - 1.5 * step_n..=full_scale_n + 0.5 * step_n).contains(&largest_n).then_some(largest_n)
}

/// What a sensor shows that can show no more than `largest`. What is not a number stays so: a simulation ran away.
pub(super) fn cut_off(value: f64, largest: f64) -> f64 {
    if value > largest { largest } else { value }
}

/// What the sensors would have shown had they no noise and no steps.
pub(super) struct Sampler<'a> {
    sensors: Vec<Sensor<'a>>,
    values: Vec<f64>,
}

/// What measures one channel.
struct Sensor<'a> {
    channel: Channel,
    /// Effects that act on it, in their order, with their states.
    effects: Vec<(&'a ActiveEffect, EffectState)>,
    /// Largest value that it can show.
    largest: f64,
}

impl<'a> Sampler<'a> {
    pub fn new(outputs: &[Channel], effects: &'a EffectSet, input: &ReplayInput) -> Self {
        let sensor = |channel: &Channel| {
            let fresh = |effect| (effect, EffectState::default());
            Sensor {
                channel: *channel,
                effects: effects.on(*channel).map(fresh).collect(),
                largest: input.largest_shown(*channel),
            }
        };
        Self { sensors: outputs.iter().map(sensor).collect(), values: vec![0.0; outputs.len()] }
    }

    pub fn sample(
        &mut self,
        config: &PlantConfig,
        plant: &Plant,
        duty: f64,
        (t_s, dt_s): (f64, f64),
    ) -> &[f64] {
        for (Sensor { channel, effects, largest }, value) in self.sensors.iter_mut().zip(&mut self.values) {
            let outside = if *channel == Channel::Duty { duty } else { 0.0 };
            let mut port =
                SensorPort { t_s, dt_s, value: plant.channel(config, *channel).unwrap_or(outside) };
            for (active, state) in effects {
                active.effect.measure(&active.parameters, state, &mut port);
            }
            *value = cut_off(port.value, *largest);
        }
        &self.values
    }
}

/// Values of one sensor, sample by sample, at the given times of the bench.
pub fn through(
    t_s: &[f64],
    values: &[f64],
    mut sensor: impl FnMut(&mut EffectStates, &mut SensorPort),
) -> Vec<f64> {
    let mut states = FRESH_STATES;
    let mut before_s = t_s.first().copied().unwrap_or(0.0);
    t_s.iter()
        .zip(values)
        .map(|(&t_s, &value)| {
            let mut port = SensorPort { t_s, dt_s: t_s - before_s, value };
            before_s = t_s;
            sensor(&mut states, &mut port);
            port.value
        })
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    /// 100 N in 4096 steps of 0.0244 N: the converter ends at 99.9756 N.
    #[test]
    fn a_channel_ends_where_its_converter_does() {
        let sensors = SensorParameters { tension_full_scale_n: 100.0, adc_bits: 12, ..Default::default() };
        let of = |channel, largest_n| {
            let recording =
                Recording::new("any", vec![0.0, 1e-3, 2e-3]).with(channel, vec![3.0, largest_n, 5.0]);
            end_of_scale_n(&sensors, &recording, channel)
        };
        assert_eq!(of(Channel::F1, 99.9756), Some(99.9756));
        assert_eq!(of(Channel::F4, 100.0), Some(100.0), "some files have the full scale itself");
        assert_eq!(of(Channel::F1, 99.9), None, "a reading below its end");
        assert_eq!(of(Channel::F1, 104.0), None, "a scale that the rig file does not know");
        assert_eq!(of(Channel::ThetaOut, 99.9756), None, "an angle");
    }
}
