//! A sensor that shows its value late: behind a first-order filter, `τ dy/dt = x - y`, or after a dead time `τ`, which five equal filters in
//! series stand for, `(τ/5) dy_i/dt = y_{i-1} - y_i`. Either shows a ramp late by `τ`.

use crate::channel::Channel;
use crate::effect::{Component, Descriptor, Effect, EffectState, MAX_PARAMETERS, ParameterSpec, SensorPort};
use crate::search::Starts;
use libm::expm1;

/// A sensor behind a first-order filter, `τ dy/dt = x - y`, or a dead time `τ`.
pub struct SensorLag;

static DESCRIPTOR: Descriptor = Descriptor {
    id: "sensor_lag",
    component: Component::Sensors,
    summary: "a sensor shows its value late",
    parameters: &[
        ParameterSpec::log(
            "time_constant_s",
            "s",
            [1e-4, 5.0],
            0.02,
            "time by which it shows a steady change late",
        ),
        ParameterSpec::choice("dead_time", "0: a filter of first order; 1: a dead time"),
    ],
    neutral: None,
    channels: &Channel::SENSED,
};

/// Filters in series that stand for a dead time: a step passes within ±45 % of it.
const STAGES: usize = 5;

impl Effect for SensorLag {
    fn descriptor(&self) -> &'static Descriptor {
        &DESCRIPTOR
    }

    fn starts(&self) -> Starts {
        Starts::At("time_constant_s", &[0.01, 0.05, 0.2])
    }

    fn is_shared_by_tensions(&self) -> bool {
        true
    }

    fn measure(&self, p: &[f64; MAX_PARAMETERS], s: &mut EffectState, port: &mut SensorPort) {
        // State: what each filter shows, and whether there was a value.
        let (stages, begun) = s.split_at_mut(STAGES);
        if begun[0] == 0.0 {
            stages.fill(port.value);
            begun[0] = 1.0;
        }
        let stages = if p[1] == 0.0 { &mut stages[..1] } else { stages };
        let passed = -expm1(-port.dt_s * stages.len() as f64 / p[0]);
        for stage in stages {
            *stage += passed * (port.value - *stage);
            port.value = *stage;
        }
    }
}
