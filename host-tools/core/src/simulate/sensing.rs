//! What the sensors of a forward run show: effects of the sensors, noise, range and steps.

use std::f64::consts::TAU;

use bowden_model::channel::Channel;
use bowden_model::drive::BridgeInput;
use bowden_model::effect::SensorPort;
use bowden_model::effect_set::{EffectStates, FRESH_STATES};
use bowden_model::parameters::SensorParameters;
use bowden_model::plant::{Plant, PlantConfig};
use rand_distr::{Distribution, StandardNormal};
use rand_pcg::Pcg64;

use crate::rig::Rig;

/// Sensors of a run, in the order of its columns.
pub(super) struct Sensors {
    parameters: SensorParameters,
    columns: Vec<Sensor>,
    last_s: Option<f64>,
}

struct Sensor {
    channel: Channel,
    states: EffectStates,
    noise: Pcg64,
}

impl Sensors {
    pub(super) fn new(rig: &Rig, channels: &[Channel], seed: u64) -> Self {
        // Every channel has a stream of its own, so that one more column changes no other.
        let columns = channels.iter().map(|channel| Sensor {
            channel: *channel,
            states: FRESH_STATES,
            noise: Pcg64::new(u128::from(seed), *channel as u128),
        });
        Self { parameters: rig.joint.sensors, columns: columns.collect(), last_s: None }
    }

    /// Readings at `t_s`, one a column. The reference, the duty and the supply are logged, not measured.
    pub(super) fn read(
        &mut self,
        config: &PlantConfig,
        plant: &Plant,
        t_s: f64,
        reference_rad: f64,
        bridge: BridgeInput,
    ) -> Vec<f64> {
        let dt_s = t_s - self.last_s.replace(t_s).unwrap_or(t_s);
        let parameters = self.parameters;
        let read = |sensor: &mut Sensor| {
            let Some(value) = plant.channel(config, sensor.channel) else {
                return match sensor.channel {
                    Channel::ThetaRef => reference_rad,
                    Channel::Duty => bridge.duty,
                    Channel::BusVoltage => bridge.bus_v,
                    _ => f64::from(u8::from(bridge.enabled)),
                };
            };
            let mut port = SensorPort { t_s, dt_s, value };
            config.effects().measure(sensor.channel, &mut sensor.states, &mut port);
            digitised(&parameters, sensor.channel, port.value, &mut sensor.noise)
        };
        self.columns.iter_mut().map(read).collect()
    }
}

/// Noise and steps of the converters. Encoders count a whole turn, tensions begin at zero.
fn digitised(parameters: &SensorParameters, channel: Channel, value: f64, noise: &mut Pcg64) -> f64 {
    let steps = |bits: u32| f64::from(bits).exp2();
    let mut normal = |std: f64| -> f64 {
        let sample: f64 = StandardNormal.sample(noise);
        std * sample
    };
    match channel {
        Channel::ThetaMotor | Channel::ThetaIn | Channel::ThetaOut => {
            let rad_per_count = TAU / steps(parameters.encoder_bits);
            (value / rad_per_count).round() * rad_per_count
        }
        Channel::F1 | Channel::F2 | Channel::F3 | Channel::F4 => {
            let codes = steps(parameters.adc_bits);
            let n_per_lsb = parameters.tension_step_n();
            let code = ((value + normal(parameters.tension_noise_n)) / n_per_lsb).round();
            code.clamp(0.0, codes - 1.0) * n_per_lsb
        }
        Channel::MotorCurrent => value + normal(parameters.current_noise_a),
        Channel::ThetaRef
        | Channel::TorqueIn
        | Channel::TorqueOut
        | Channel::Duty
        | Channel::BusVoltage
        | Channel::DriveEnable => value,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const PARAMETERS: SensorParameters = SensorParameters {
        encoder_bits: 12,
        tension_full_scale_n: 98.0665,
        adc_bits: 12,
        tension_noise_n: 0.1,
        current_noise_a: 0.01,
    };

    #[test]
    fn angles_and_tensions_lie_on_the_steps_of_their_converters() {
        let mut noise = Pcg64::new(1, 1);
        // A count of 12 bits is 1.533981 mrad, a code of the converter 23.94202 mN.
        let angle = digitised(&PARAMETERS, Channel::ThetaIn, -0.01, &mut noise);
        assert!((angle - -7.0 * 1.533_980_788e-3).abs() < 1e-9, "{angle}");
        for value in [31.0, 500.0, -3.0] {
            let tension = digitised(&PARAMETERS, Channel::F1, value, &mut noise);
            let code = tension / 23.942_016_6e-3;
            assert!((code - code.round()).abs() < 1e-4, "{tension}");
            assert!((0.0..=98.042_6).contains(&tension), "{tension}");
        }
    }

    #[test]
    fn noise_has_the_stated_spread() {
        let mut noise = Pcg64::new(7, 0);
        let readings: Vec<f64> =
            (0..20_000).map(|_| digitised(&PARAMETERS, Channel::MotorCurrent, 1.5, &mut noise)).collect();
        let mean = readings.iter().sum::<f64>() / 20_000.0;
        let variance = readings.iter().map(|r| (r - mean).powi(2)).sum::<f64>() / 20_000.0;
        // Five standard deviations of mean (0.01 / √n) and spread (0.01 / √2n).
        assert!((mean - 1.5).abs() < 3.6e-4, "{mean}");
        assert!((variance.sqrt() - 0.01).abs() < 2.5e-4, "{}", variance.sqrt());
    }
}
