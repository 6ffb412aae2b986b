//! A sensor behind a first-order filter: `τ dy/dt = x - y`.

use crate::channel::Channel;
use crate::effect::{Component, Descriptor, Effect, EffectState, MAX_PARAMETERS, ParameterSpec, SensorPort};
use crate::search::Starts;
use libm::expm1;

/// A sensor behind a first-order filter: `τ dy/dt = x - y`.
pub struct SensorLag;

static DESCRIPTOR: Descriptor = Descriptor {
    id: "sensor_lag",
    component: Component::Sensors,
    summary: "a sensor shows its value late",
    parameters: &[ParameterSpec::log(
        "time_constant_s",
        "s",
        [1e-4, 5.0],
        0.02,
        "time constant of the filter",
    )],
    neutral: None,
    channels: &Channel::SENSED,
};

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
        // State: value shown last, and whether there was one.
        if s[1] == 0.0 {
            s[0] = port.value;
            s[1] = 1.0;
        }
        s[0] -= expm1(-port.dt_s / p[0]) * (port.value - s[0]);
        port.value = s[0];
    }
}
