//! Sensors of a replay: channels as they would show without noise and steps.

use bowden_model::channel::Channel;
use bowden_model::effect::{ActiveEffect, EffectState, SensorPort};
use bowden_model::effect_set::{EffectSet, EffectStates, FRESH_STATES};
use bowden_model::plant::{Plant, PlantConfig};

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
}

impl<'a> Sampler<'a> {
    pub fn new(outputs: &[Channel], effects: &'a EffectSet) -> Self {
        let sensor = |channel: &Channel| {
            let fresh = |effect| (effect, EffectState::default());
            Sensor { channel: *channel, effects: effects.on(*channel).map(fresh).collect() }
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
        for (Sensor { channel, effects }, value) in self.sensors.iter_mut().zip(&mut self.values) {
            let outside = if *channel == Channel::Duty { duty } else { 0.0 };
            let mut port =
                SensorPort { t_s, dt_s, value: plant.channel(config, *channel).unwrap_or(outside) };
            for (active, state) in effects {
                active.effect.measure(&active.parameters, state, &mut port);
            }
            *value = port.value;
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
