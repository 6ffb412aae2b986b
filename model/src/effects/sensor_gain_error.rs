//! A sensor with a wrong scale: shown `g x`.

use crate::channel::Channel;
use crate::effect::{Component, Descriptor, Effect, EffectState, MAX_PARAMETERS, ParameterSpec, SensorPort};

/// A sensor with a wrong scale: shown `g x`.
pub struct SensorGainError;

static DESCRIPTOR: Descriptor = Descriptor {
    id: "sensor_gain_error",
    component: Component::Sensors,
    summary: "a sensor has a wrong gain",
    parameters: &[ParameterSpec::log("gain", "1", [0.2, 5.0], 1.1, "shown over true")],
    neutral: Some(1.0),
    channels: &Channel::SENSED,
};

impl Effect for SensorGainError {
    fn descriptor(&self) -> &'static Descriptor {
        &DESCRIPTOR
    }

    fn measure(&self, p: &[f64; MAX_PARAMETERS], _s: &mut EffectState, port: &mut SensorPort) {
        port.value *= p[0];
    }

    fn correct(&self, p: &[f64; MAX_PARAMETERS], _s: &mut EffectState, port: &mut SensorPort) {
        port.value /= p[0];
    }
}
